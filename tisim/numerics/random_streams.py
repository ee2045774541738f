"""The streams of random numbers; every use of ``philox.bits`` has its own stream.

Two uses of one seed with the same stream would draw the same numbers. A stream is a number below 2^32.
"""

BROWNIAN_MOTION = 1
"""Stream of the thermal noise of Brownian steppers."""
TRIAL_MOVES = 0x54524D56
"""Stream of the trial moves of growing hard bodies."""
RANDOM_REMOVAL = 0x52524D00
"""Stream of the random directions in which overlaps of rods are removed, for comparison (case packing)."""
SEQUENTIAL_ADDITION = 0x52534100
"""Stream of the trial positions of random sequential addition."""
GRAIN_SIZES = 0x47524149
"""Stream of the grain sizes of an initial state."""
MOMENTS = 0x4D4F4D45
"""Stream of the moment directions of permanent magnets."""
INSERTION = 0x494E5300
"""First of the streams of the insertion trials, one for each insertion by index in the scene."""
CORE_MOMENTS = 0x434F5245
"""Stream of the moments of the magnetic cores of grains of one size."""
ADHESION = 0x41444800
"""Stream of the choice of captured particles that adhere."""
INLET = 0x494E4C00
"""First of the streams of the entry times and places at inlets, one for each inlet by index in the scene."""
