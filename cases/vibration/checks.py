"""Checks of Z13: its numbers, and comparisons of runs with the closed forms of the centre of gravity."""

from collections.abc import Iterator

import numpy as np

from tisim import Result, run
from tisim.cases.case import Check
from tisim.cases.vibration.closed_forms import centre, exact, resonances
from tisim.cases.vibration.response import BEAT_DRIVE, FAST, SLOW, Sweep, beats, fast_scenes, slow_scenes
from tisim.cases.vibration.scene import ATTRACTION, CYCLOTRON, MASS, RATIOS, REPULSION, STIFFNESS, scene
from tisim.steppers import Collocation, StageControl


def deviation(results: list[Result]) -> float:
    """Return the largest distance of the centre of gravity from its closed form, over the largest
    displacement."""
    computed, true = (np.array([f(result) for result in results]) for f in (centre, exact))
    return float(np.linalg.norm(computed - true, axis=1).max() / np.linalg.norm(true, axis=1).max())


def check() -> Iterator[Check]:
    """Yield Z13's numbers and its misprint; centre of gravity, resonances and beats compared with their
    closed forms."""
    slow, fast = resonances(CYCLOTRON, STIFFNESS / MASS)
    yield Check("w = q B/m, 1/s (printed: 1819.385)", CYCLOTRON, 954.930, 1e-3)
    yield Check("sqrt(k/m), 1/s", float(np.sqrt(STIFFNESS / MASS)), 21.851, 1e-3)
    pair = float(np.sqrt(ATTRACTION * (ATTRACTION / REPULSION) ** 2 / MASS))
    yield Check("sqrt(alpha_1 (alpha_1/alpha_2)^2/m), 1/s", pair, 87.404, 1e-3)
    yield Check("product of the two resonances, k/m, 1/s^2", slow * fast, STIFFNESS / MASS, 1e-9)
    single = run([scene(r, "none", duration=0.05, sites=1, observed=True) for r in RATIOS])
    yield Check("one particle, 0.05 s, all of Fig. 3: deviation", deviation(single), 0.0, 1e-3)
    some = (0.1, 0.8, 1.8)
    fine = {"stepper": Collocation(control=StageControl(error=1e-6))}
    cloud = run([scene(r, duration=0.05).model_copy(update=fine) for r in some])
    off = deviation(cloud)
    yield Check("centre of gravity, 343 particles as printed, 0.05 s: deviation", off, 0.0, 1e-6)
    drift = max(float(np.abs(np.average(r.state["position"], axis=0)[2])) for r in cloud)
    yield Check("drift of the centre of gravity along z, m", drift, 0.0, 1e-12)
    around = Sweep.of(fast_scenes(np.linspace(0.9, 1.1, 21)))
    yield Check("largest displacement within 0.1 s, 0.9 to 1.1 w: deviation", around.deviation, 0.0, 1e-3)
    yield Check("Omega of the largest response over the fast resonance", around.top() / FAST, 1.0, 5e-3)
    slowly = Sweep.of(slow_scenes(np.linspace(0.3, 0.7, 21)))
    yield Check("largest displacement within 60 s, 0.3 to 0.7 1/s: deviation", slowly.deviation, 0.0, 1e-4)
    yield Check("Omega of the largest response over the slow resonance", slowly.top() / SLOW, 1.0, 2e-2)
    beat = FAST * (1 - BEAT_DRIVE)
    yield Check("beat period at 0.9 of the fast resonance, s", beats().beat_period(), 2 * np.pi / beat, 3e-4)
