"""The inverse problem of cascade: orient the fibres and time the stages so that most particles are captured
soonest.

A design is the angle of each of the first fibres to the field and the time that particles spend about each;
the cascade repeats them in this order until 90 % of the particles are captured. B16 compares two cascades of
stages of equal length: one of fibres across the field, and one of fibres of random orientation (section
6.4.5). Particles begin each stage at OFF from the fibre, at which the cascade of fibres across the field
takes as long as in B16. In a stage that is too short few of them reach the fibre, and one that is too long
waits for particles that have diffused away.

A design is several runs, one for each stage, so the problem is a function of the design and of a seed.
"""

from collections.abc import Mapping

from tisim.cases.cascade.scene import SIZES, TITLE, PlannedCascade
from tisim.cases.cascade.statistics import CAPTURED_SHARE, OFF, PUBLISHED_TIMES, captured_at, time_to
from tisim.cases.case import searched_size
from tisim.errors import InputError, must
from tisim.optimize import Gene, Genome, Objective, Problem

CASCADE_VARIANTS = ("soonest",)
FIBRES = 6
"""Number of fibres, and of stages, that are designed."""
NANOMETRES = 25
"""Radius of the particles, nm."""
STAGE_RANGE = (5.0, 100.0)
"""Shortest and longest time of a stage, s; B16 has 10 s."""
GIVEN_UP = 4 * PUBLISHED_TIMES[NANOMETRES][0]
"""Time after which a cascade is given up, s: four times B16's time of random fibres."""
ANGLES = tuple(f"angle_{k + 1}" for k in range(FIBRES))
TIMES = tuple(f"stage_{k + 1}" for k in range(FIBRES))
GENOME = Genome(
    (
        *(Gene(name, "degrees", 0.0, 90.0) for name in ANGLES),
        *(Gene(name, "s", *STAGE_RANGE, scale="log") for name in TIMES),
    )
)
MEANINGS = {
    "time": f"time at which {CAPTURED_SHARE:.0%} of the particles are captured",
    ANGLES[0]: "angle of the first fibre to the field; 90 degrees is across it",
    TIMES[0]: "time that particles spend about the first fibre",
}


def planned(design: Mapping[str, float]) -> PlannedCascade:
    """Return the cascade of a design."""
    return PlannedCascade(
        nanometres=NANOMETRES,
        gap=OFF,
        angles=tuple(design[name] for name in ANGLES),
        stages=tuple(design[name] for name in TIMES),
    )


def capture_time(design: Mapping[str, float], seed: int) -> float:
    """Return the time to capture 90 % of the particles, s.

    InputError if it is longer than GIVEN_UP.
    """
    (times,) = captured_at([planned(design)], repeats=1, seed=seed, longest=GIVEN_UP)
    found = float(time_to(CAPTURED_SHARE, times)[0])
    if found > GIVEN_UP:
        raise InputError(
            f"time to capture {CAPTURED_SHARE:.0%} must be at most {GIVEN_UP:g} s; received more"
        )
    return found


def problem(size: str = "default", variant: str = "soonest") -> Problem:
    """Return the search for the angles and times that capture most particles soonest.

    The only size is "default", and the only variant is "soonest".
    """
    searched_size(size, SIZES)
    must(variant in CASCADE_VARIANTS, "variant", f"one of {', '.join(CASCADE_VARIANTS)}", variant)
    return Problem.of_function(
        capture_time,
        GENOME,
        (Objective("time", lambda result: result.value, "s"),),
        name="cascade",
        title=TITLE,
        description=f"the angles and times of {FIBRES} fibres that capture {CAPTURED_SHARE:.0%} of the "
        f"particles of {NANOMETRES} nm soonest",
        meanings=MEANINGS,
    )
