"""Groups that move as prescribed, and rigid clumps."""
