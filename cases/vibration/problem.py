"""The inverse problem of vibration: find the field and the binder with the largest or the smallest response
to a drive.

The centre of gravity moves like one particle (see ``scene``), so each run has one particle. The solution is
known: a drive at Omega is in resonance with the fast or the slow motion if k/m = Omega^2 -+ w Omega, so the
best designs lie on these two lines of the plane of B and k.
"""

from collections.abc import Mapping

import numpy as np

from tisim import Result, Scene
from tisim.cases.vibration import scene as vibration
from tisim.cases.vibration.closed_forms import resonances
from tisim.cases.vibration.response import peak
from tisim.cases.vibration.scene import CHARGE, FIELD, MASS
from tisim.errors import must
from tisim.optimize import Gene, Genome, Problem

VARIANTS = ("resonate", "avoid")
"""The inverse problems: the largest and the smallest response to a given drive."""
DRIVE = 0.8 * vibration.CYCLOTRON
"""Omega of Z13 figure 3(d), 1/s: far from resonance with the paper's field and binder."""
DURATION = 0.2
"""The simulated time of a run, s: 24 periods of the drive."""

GENES = (
    Gene("flux", "T", 0.2, 2.0),
    Gene("stiffness", "N/m", 1.0, 1000.0, "log"),
)
"""The range of the flux includes the paper's 1 T; the stiffness begins at twice the paper's 0.5 N/m, and
sqrt(k/m) is 31 to 977 1/s."""

MEANING = "largest displacement of the centre of gravity; with a minus sign if it is maximised"


def scene(design: Mapping[str, float], drive: float = DRIVE, duration: float = DURATION) -> Scene:
    """Return one particle with the field and the binder of a design. Nothing in it is random."""
    return vibration.scene(
        drive / vibration.CYCLOTRON, "none", duration, sites=1, error=1e-5,
        flux=design["flux"], stiffness=design["stiffness"], observed=True,
    )  # fmt: skip


def displacement(result: Result) -> float:
    """Return the largest displacement of the centre of gravity, m."""
    return result.measures["peak_displacement"]


def closed_form(design: Mapping[str, float], drive: float = DRIVE, duration: float = DURATION) -> float:
    """Return the largest displacement of a design in closed form, without a run, m."""
    w, k_m = CHARGE * design["flux"] / MASS, design["stiffness"] / MASS
    return peak(duration, w, k_m, CHARGE * FIELD / MASS, drive)


def nearest(design: Mapping[str, float], drive: float = DRIVE) -> float:
    """Return the resonance of a design that is nearest to the drive, 1/s."""
    both = resonances(CHARGE * design["flux"] / MASS, design["stiffness"] / MASS)
    return min(both, key=lambda omega: abs(np.log(omega / drive)))


def problem(size: str = "default", variant: str = "resonate") -> Problem:
    """Return the search for the field and binder with the largest or the smallest response to DRIVE in
    DURATION.

    The variants are "resonate" and "avoid". The only size is "default", because a search runs one particle.
    """
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    aim, sign = ("largest", -1e3) if variant == "resonate" else ("smallest", 1e3)
    symbol = "-peak (mm)" if sign < 0 else "peak (mm)"
    return Problem(
        name=f"vibration-{variant}",
        title=f"{vibration.TITLE}: the {aim} response to {DRIVE:.1f} 1/s within {DURATION} s",
        description=f"the {aim} response to a drive of {DRIVE:.1f} 1/s",
        genome=Genome(GENES),
        scene=lambda design, seed: scene(design),
        objective=lambda result: sign * displacement(result),
        symbol=symbol,
        meanings={symbol: MEANING},
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
    """Return the design's resonances and the drive, and its response in the run and in closed form."""
    slow, fast = resonances(CHARGE * design["flux"] / MASS, design["stiffness"] / MASS)
    return {
        "drive frequency, 1/s": DRIVE,
        "fast resonance of the design, 1/s": fast,
        "slow resonance of the design, 1/s": slow,
        "nearest resonance over drive": nearest(design) / DRIVE,
        "largest displacement, m": displacement(result),
        "largest displacement in closed form, m": closed_form(design),
    }
