"""The status of the worlds of a batch, and the names of the world fields of a state."""

from enum import IntEnum

from tisim.errors import must


class WorldStatus(IntEnum):
    """The status of a world; of several failures in one phase, the one with the highest number counts."""

    RUNNING = 0
    ENDED = 1
    """The world has reached its end."""
    NOT_FINITE = 2
    """A quantity of a particle is not finite."""
    OUT_OF_ROOM = 3
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


NO_ONE = 2**31 - 1
"""Value of failing_particle and failing_effect if no particle, or no effect, has stopped the world."""
ASKED = NO_ONE - 1
"""Value of failing_effect if a force has stopped the world and has not been identified yet."""

NEVER = 2**62
"""A number of steps that no world reaches."""


WORLD_QUANTITIES = (
    *("time", "time_carry", "end", "dt", "approach_time", "fastest", "volume", "failure_time"),
    *("reached", "cut"),
)
"""World quantities (f64) for the time of a world and its steps."""
WORLD_INTEGERS = (
    *("count", "status", "failed", "failing_particle", "failing_effect"),
    "ending_effect",
    *("changed", "events", "next_id", "underway"),
)
"""World integers (i32) for the number of particles of a world and its status."""
WORLD_VECTORS = ("frame", "displacement")
"""World vectors (f64) for the displacement of the particles."""
WORLD_COUNTERS = ("steps", "particle_steps")
"""Counters (i64) of every world."""
WORLD_SETTINGS = (
    "seed",
    "skin",
    "step_ahead",
    "most",
    "pause_time",
    "place",
    "occasion",
    "goal",
    "step_limit",
    "listed_above",
)
"""Settings of a world, and the limits at which it waits."""
ATTRIBUTES = (
    *("worlds", "capacity", "fields", "counters", "world_quantities", "flags", "totals", "reported"),
    *("real", "records", "shared", "domain", "before_reading", "columns", "singles", "slotted", "defaults"),
    *("copied", "means", "sums"),
)


def check_names(state: type, names: tuple[str, ...]) -> None:
    """Raise InputError if a declared name is used twice or has another meaning on a state."""
    for k, name in enumerate(names):
        taken = name in (
            *WORLD_QUANTITIES,
            *WORLD_INTEGERS,
            *WORLD_VECTORS,
            *WORLD_COUNTERS,
            *WORLD_SETTINGS,
            *ATTRIBUTES,
            *names[:k],
        )
        free = name.isidentifier() and not taken and not hasattr(state, name)
        must(free, "name of a field, counter, flag or quantity", "a name of no other use on a state", name)
