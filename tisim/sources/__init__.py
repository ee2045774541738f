"""External fields of place and time, one file each."""
