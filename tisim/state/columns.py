"""The names of what a state holds of each world, beside what effects and steppers declare."""

from tisim.errors import must

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
