"""The status of the worlds of a batch."""

from enum import IntEnum


class WorldStatus(IntEnum):
    """The status of a world; of several failures in one phase, the one with the highest number counts."""

    RUNNING = 0
    ENDED = 1
    """The world has reached its end."""
    NOT_FINITE = 2
    """A quantity of a particle is not finite."""
    OUT_OF_CAPACITY = 3
    """There is no free slot for another particle."""
    CONTACT_OVERFLOW = 4
    """More simultaneous contacts than a particle, or a world, can store."""
    NOT_CONVERGED = 5
    """A self-consistent quantity of the particles does not converge."""
    POSITION_LOST = 6
    """A particle has left the box so far that rounding loses its position in it."""
    STEP_TOO_SHORT = 7
    """The implicit equations of a step cannot be solved even at the shortest step."""
    FORCE_TOO_STEEP = 8
    """A force requires a step shorter than the shortest."""
    NOT_POSITIVE_DEFINITE = 9
    """A diffusion matrix is not positive definite."""
    STEP_TOO_LONG = 10
    """A step is too long compared with the critical step of the forces on a particle."""
    LIST_OVERFLOW = 11
    """More near pairs than their list can hold; the list is lengthened, and the world continues."""
    OUTRUN = 12
    """Grains move so far in a step that they may pass through each other undetected."""
    OVERLAPPING = 13
    """The overlaps of the start of a packing could not be removed."""
    BOX_TOO_NARROW = 14
    """Bodies have grown so long that two of them may touch at two periodic images at once."""


NO_ONE = 2**31 - 1
"""Value of failing_particle and failing_effect if no particle, or no effect, has stopped the world."""
ASKED = NO_ONE - 1
"""Value of failing_effect if a force has stopped the world and has not been identified yet."""

NEVER = 2**62
"""A number of steps that no world reaches."""
