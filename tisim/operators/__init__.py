"""Changes of state between steps, one file each."""
