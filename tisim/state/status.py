"""How the worlds of a batch are doing, and the names of what a state holds of each."""

from enum import IntEnum

from tisim.errors import must


class WorldStatus(IntEnum):
    """A status says how a world is doing; of several failures in one phase, the one with the highest number
    counts."""

    RUNNING = 0
    ENDED = 1
    """The world has reached its end."""
    NOT_FINITE = 2
    """A quantity of a particle is not finite."""
    OUT_OF_ROOM = 3
    """There is no free slot for another particle."""
    CONTACT_OVERFLOW = 4
    """There are more simultaneous contacts than there is room for."""
    NOT_CONVERGED = 5
    """A self-consistent quantity of the particles does not converge."""
    POSITION_LOST = 6
    """A particle has left the box so far that rounding loses its position."""
    STEP_TOO_SHORT = 7
    """The implicit equations of a step cannot be solved even at the shortest step."""
    FORCE_TOO_STEEP = 8
    """A force asks for a step shorter than the shortest."""
    NOT_POSITIVE_DEFINITE = 9
    """A diffusion matrix is not positive definite."""
    STEP_TOO_LONG = 10
    """A step is too long beside the critical step of the forces on a particle."""
    LIST_OVERFLOW = 11
    """There are more near pairs than their list has room for; it is made longer, and the world goes on."""
    OUTRUN = 12
    """Grains move so far in a step that they may pass through each other unseen."""


NO_ONE = 2**31 - 1
"""This is the value of failing_particle and failing_effect of a world that no particle, or no effect, has
stopped."""
ASKED = NO_ONE - 1
"""This is the value of failing_effect where a force has stopped a world and which of them is not yet
known."""

NEVER = 2**62
"""This is a number of steps that no world gets to."""


WORLD_QUANTITIES = (
    *("time", "time_carry", "end", "dt", "approach_time", "fastest", "volume", "failure_time"),
    *("reached", "cut"),
)
"""These quantities of a world (f64) tell its time and how its steps go."""
WORLD_INTEGERS = (
    *("count", "status", "failed", "failing_particle", "failing_effect"),
    "ending_effect",
    *("changed", "events", "next_id", "underway"),
)
"""These integers of a world (i32) tell how many particles it has and how it is doing."""
WORLD_VECTORS = ("frame", "displacement")
"""These vectors of a world (f64) tell how far its particles have moved."""
WORLD_COUNTERS = ("steps", "particle_steps")
"""These counters (i64) are those that every world keeps."""
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
"""These numbers of a world say what it is and what it waits for."""
ATTRIBUTES = (
    *("worlds", "capacity", "fields", "counters", "world_quantities", "flags", "totals", "reported"),
    *("real", "records", "shared", "domain", "before_reading", "columns", "singles", "slotted", "defaults"),
    *("copied", "means", "sums"),
)


def check_names(state: type, names: tuple[str, ...]) -> None:
    """Raise InputError where a declared name is that of another one, or means something else on a state."""
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
