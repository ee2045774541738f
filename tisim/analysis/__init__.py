"""What positions of particles say about their arrangement, in NumPy."""
