"""Constraints: groups that move as prescribed, and rigid bodies."""
