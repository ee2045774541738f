"""The streams of random numbers: every use of ``philox.bits`` has one of its own.

Two uses of one seed that shared a stream would draw the same numbers. A stream is a number below 2^32.
"""

BROWNIAN_MOTION = 1
"""The thermal noise of Brownian steppers draws from this stream."""
SEQUENTIAL_ADDITION = 0x52534100
"""Random sequential addition draws the places that it tries from this stream."""
GRAIN_SIZES = 0x47524149
"""The sizes of the grains of a start are drawn from this stream."""
MOMENTS = 0x4D4F4D45
"""The directions of the moments of permanent magnets are drawn from this stream."""
INSERTION = 0x494E5300
"""Insertions draw grains and the places that they try from this stream and, by index in the scene, from those
after it."""
