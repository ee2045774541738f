"""The inverse problem of spin_up: find the magnetisation and the spin that leave the most elongated fragment.

A design is the magnetisation of the grains in L21's pile and the spin to which the pile is brought, in steps
as in L21. L21 sets the fragments of its strongly magnetised pile, 6:1 and 5:1, beside the interstellar object
'Oumuamua and the asteroid 216 Kleopatra (section 4.6).

A run has several stages, because the spin of a pile is increased while it is simulated. The problem is
therefore a function of the design and of a seed.
"""

from collections.abc import Mapping

from tisim.cases.case import searched_size
from tisim.cases.coalescence import published
from tisim.cases.spin_up.fragments import LEAST_GRAINS, fragments
from tisim.cases.spin_up.scene import DEFAULT, SIZES, TITLE
from tisim.cases.spin_up.stages import RATES, spun_up
from tisim.errors import must
from tisim.optimize import Gene, Genome, Objective, Problem

SPUN_VARIANTS = ("elongated",)
LARGEST_SPIN = 1500.0
"""Largest spin of a design, urad/s; piles of 1190 A/m have broken at 1200."""
STEP = RATES[0]
"""Difference of successive spins, rad/s."""
SPUN_GENES = (
    Gene("magnetisation", "A/m", published.MAGNETISATIONS[0], published.MAGNETISATIONS[-1]),
    Gene("spin", "urad/s", 1e6 * STEP, LARGEST_SPIN),
)
SPUN_MEANINGS = {
    "elongation": f"longest over shortest axis of the most elongated body of at least {LEAST_GRAINS} grains",
    "magnetisation": "magnetisation of the grains of a pile as large as L21's",
    "spin": "last angular velocity to which the pile is brought",
}


def rates_to(spin: float) -> tuple[float, ...]:
    """Return the successive angular velocities of a pile that is brought to a spin, rad/s."""
    before = (STEP * k for k in range(1, int(LARGEST_SPIN * 1e-6 / STEP) + 1))
    return (*(rate for rate in before if rate < spin * (1 - 1e-9)), spin)


def final_elongation(design: Mapping[str, float], seed: int) -> float:
    """Return the longest over the shortest axis of the most elongated body of at least LEAST_GRAINS grains
    after the last step; 1 if there is none."""
    rates = rates_to(1e-6 * design["spin"])
    (one,) = spun_up([(design["magnetisation"], seed)], rates=rates, **DEFAULT)
    return max((body.elongation for body in fragments(one.steps[-1].state)), default=1.0)


def problem(size: str = "default", variant: str = "elongated") -> Problem:
    """Return the search for the magnetisation and the spin that leave the most elongated fragment.

    The only size is "default", and the only variant is "elongated".
    """
    searched_size(size, SIZES)
    must(variant in SPUN_VARIANTS, "variant", f"one of {', '.join(SPUN_VARIANTS)}", variant)
    return Problem.of_function(
        final_elongation,
        Genome(SPUN_GENES),
        (Objective("elongation", lambda result: result.value, "", maximise=True),),
        name=f"spin_up-{variant}",
        title=TITLE,
        description="the magnetisation and the spin that leave the most elongated fragment",
        meanings=SPUN_MEANINGS,
    )
