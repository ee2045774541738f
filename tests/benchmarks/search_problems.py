"""The problems of search.py: functions with a known minimum, and searches of cases and of one scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.constants import elementary_charge, proton_mass

import tisim
from tisim.cases.agglomeration.problem import problem as agglomeration
from tisim.cases.avalanche.problem import problem as avalanche
from tisim.cases.blast.problem import problem as blast
from tisim.cases.capture.filter import CHANNEL_HEIGHT, CHANNEL_WIDTH
from tisim.cases.capture.problem import STREAM_GENES
from tisim.cases.capture.problem import problem as capture
from tisim.cases.mrf_shear.problem import problem as mrf_shear
from tisim.cases.valve.problem import problem as valve
from tisim.cases.vibration.problem import GENES as VIBRATION_GENES
from tisim.cases.vibration.problem import closed_form
from tisim.cases.vibration.problem import problem as vibration
from tisim.effects import Lorentz
from tisim.optimize import Gene, Genome, Objective, Problem
from tisim.sources import MagneticField
from tisim.steppers import Boris, FixedStep

Design = Mapping[str, float]


@dataclass(frozen=True)
class Task:
    """A problem, and how its searches are judged.

    problem : a function that makes the problem. starts : number of random starts (seeds) from which a peer
    runs each design, the same for all. truth : the exact cost of a design; None to take the mean over
    ``fresh`` held-out starts. least : the minimum of the cost, which is subtracted. reference, scale : for
    several costs, the reference point of hypervolumes, and the hypervolume that is reported as 1.
    """

    problem: Callable[[], Problem]
    starts: int = 1
    fresh: int = 1
    truth: Callable[[Design], float] | None = None
    least: float = 0.0
    reference: tuple[float, ...] = ()
    scale: float = 1.0


def variables(design: Design) -> np.ndarray:
    return np.array([*design.values()])


def genes(count: int, low: float = 0.0, high: float = 1.0) -> Genome:
    return Genome(tuple(Gene(f"x{i}", "", low, high) for i in range(count)))


def rosenbrock(design: Design) -> float:
    """The minimum, 0, is at 1, 1, ... in a bent valley."""
    x = variables(design)
    return float(np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2))


def ackley(design: Design) -> float:
    """The minimum, 0, is at 1.7, 1.7, ..., away from the middle of the range."""
    x = variables(design) - 1.7
    waves = np.exp(np.mean(np.cos(2 * np.pi * x)))
    return float(-20 * np.exp(-0.2 * np.sqrt(np.mean(x**2))) - waves + 20 + np.e)


HARTMANN = np.array([
    [10, 3, 17, 3.5, 1.7, 8], [0.05, 10, 17, 0.1, 8, 14],
    [3, 3.5, 1.7, 10, 17, 8], [17, 8, 0.05, 10, 0.1, 14],
])  # fmt: skip
HARTMANN_WEIGHTS = np.array([1.0, 1.2, 3.0, 3.2])
HARTMANN_PLACES = 1e-4 * np.array([
    [1312, 1696, 5569, 124, 8283, 5886], [2329, 4135, 8307, 3736, 1004, 9991],
    [2348, 1451, 3522, 2883, 3047, 6650], [4047, 8828, 8732, 5743, 1091, 381],
])  # fmt: skip


def hartmann(design: Design) -> float:
    """Four wells in six dimensions; the minimum is -3.32237."""
    squares = (variables(design) - HARTMANN_PLACES) ** 2
    return float(-HARTMANN_WEIGHTS @ np.exp(-np.sum(HARTMANN * squares, axis=1)))


def corner(design: Design) -> float:
    """A bowl whose minimum, 0, has each gene at an end of its range."""
    x = variables(design)
    return float(np.sum((x - np.arange(len(x)) % 2) ** 2))


def bowl(design: Design) -> float:
    x = variables(design)
    return float(np.sum((x - 0.3 - 0.1 * np.arange(len(x))) ** 2))


def noisy_bowl(design: Design, seed: int) -> float:
    """A bowl with noise of deviation 0.3 in each start. The noise is about as large as the difference between
    random designs."""
    at = (variables(design) * 2**32).astype(np.int64).tolist()
    return bowl(design) + 1.0 + 0.3 * float(np.random.default_rng([seed, *at]).normal())


def zdt1(design: Design) -> tuple[float, float]:
    """E. Zitzler, K. Deb and L. Thiele, Evol. Comput. 8 (2000) 173-195: the front is f2 = 1 - sqrt(f1)."""
    x = variables(design)
    g = 1 + 9 * x[1:].mean()
    return float(x[0]), float(g * (1 - np.sqrt(x[0] / g)))


def zdt3(design: Design) -> tuple[float, float]:
    """As zdt1, with a front of five parts."""
    x = variables(design)
    g = 1 + 9 * x[1:].mean()
    return float(x[0]), float(g * (1 - np.sqrt(x[0] / g) - x[0] / g * np.sin(10 * np.pi * x[0])))


def dtlz2(design: Design) -> tuple[float, float, float]:
    """K. Deb and others, CEC (2002) 825-830: the front is an eighth of the unit sphere."""
    x = variables(design)
    radius = 1 + np.sum((x[2:] - 0.5) ** 2)
    a, b = x[:2] * np.pi / 2
    return (
        float(radius * np.cos(a) * np.cos(b)),
        float(radius * np.cos(a) * np.sin(b)),
        float(radius * np.sin(a)),
    )


BENT = Genome(
    (Gene("flux", "T", 0.05, 1.0), Gene("speed", "m/s", 1e5, 3e6), Gene("angle", "degrees", -90, 90))
)
BENT_TRUTH = {"flux": 0.42, "speed": 1.3e6, "angle": 35.0}
BENT_TIME = 1e-7
"""s: with BENT_TRUTH two thirds of a circle."""


def path(design: Design, times: Sequence[float]) -> np.ndarray:
    """The position of a proton bent by a magnetic field, at times (s); x + i y, m."""
    w = elementary_charge * design["flux"] / proton_mass
    begin = design["speed"] * np.exp(1j * np.radians(design["angle"]))
    return begin * (1 - np.exp(-1j * w * np.array(times))) / (1j * w)


def bent_particle() -> Problem:
    """Find the field, speed and angle of a proton with the final position and velocity of BENT_TRUTH.

    The cost is the distance between the final positions, relative to the distance of BENT_TRUTH from the
    origin, plus the difference of the final velocities over the final speed of BENT_TRUTH.
    """
    (end,) = path(BENT_TRUTH, [BENT_TIME])
    turned = elementary_charge * BENT_TRUTH["flux"] / proton_mass * BENT_TIME
    last = BENT_TRUTH["speed"] * np.exp(1j * (np.radians(BENT_TRUTH["angle"]) - turned))

    def scene(design: Design, seed: int) -> tisim.Scene:
        angle = np.radians(design["angle"])
        velocity = design["speed"] * np.array([np.cos(angle), np.sin(angle), 0.0])
        return tisim.Scene(
            particles=tisim.Particles(
                position=[[0.0, 0.0, 0.0]], velocity=[velocity], radius=1e-6, mass=proton_mass,
                quantities={"charge": elementary_charge},
            ),
            effects=(Lorentz(), MagneticField(constant=(0.0, 0.0, design["flux"]))),
            stepper=Boris(control=FixedStep(dt=BENT_TIME / 200)),
            duration=BENT_TIME,
            seed=seed,
        )  # fmt: skip

    def miss(result: tisim.Result) -> float:
        x, v = result.state["position"][0], result.state["velocity"][0]
        off = abs(complex(x[0], x[1]) - end) / abs(end)
        return float(off + abs(complex(v[0], v[1]) - last) / abs(last))

    return Problem(name="bent", genome=BENT, scene=scene, objective=(Objective("miss", miss),), code="1")


def resonance() -> float:
    """The minimum of the cost of vibration, mm: the closed form on a fine mesh, refined around its best
    point."""
    low = np.zeros(2)
    width, best = np.ones(2), (np.inf, np.zeros(2))
    genome = Genome(VIBRATION_GENES)
    for _ in range(12):
        mesh = [
            np.clip(low + width * (i, j), 0, 1) for i in np.linspace(0, 1, 81) for j in np.linspace(0, 1, 81)
        ]
        found = min(((-1e3 * closed_form(genome.decode(x)), x) for x in mesh), key=lambda pair: pair[0])
        best = min(best, found, key=lambda pair: pair[0])
        width = width / 8
        low = best[1] - width / 2
    return float(best[0])


def function(of: Callable[..., object], genome: Genome, costs: int = 1) -> Callable[[], Problem]:
    names = ("value",) if costs == 1 else tuple(f"f{k}" for k in range(1, costs + 1))
    return lambda: Problem.of_function(of, genome, objectives=names)


FULL_STREAM = STREAM_GENES[0].high * CHANNEL_WIDTH * CHANNEL_HEIGHT
"""The largest throughput of capture, m^3/s."""
TASKS = {
    "rosenbrock": Task(function(rosenbrock, genes(4, -2, 2))),
    "ackley": Task(function(ackley, genes(10, -5, 5))),
    "hartmann": Task(function(hartmann, genes(6)), least=-3.32237),
    "corner": Task(function(corner, genes(5))),
    "noisy bowl": Task(function(noisy_bowl, genes(5)), starts=4, truth=bowl),
    "zdt1": Task(function(zdt1, genes(10), 2), reference=(1.1, 1.1), scale=0.8767),
    "zdt3": Task(function(zdt3, genes(10), 2), reference=(1.1, 1.1), scale=1.3318),
    "dtlz2": Task(function(dtlz2, genes(8), 3), reference=(1.1,) * 3, scale=1.331 - np.pi / 6),
    "bent particle": Task(bent_particle),
    "vibration": Task(vibration, least=resonance()),
    "agglomeration": Task(lambda: agglomeration("small"), starts=4, fresh=64),
    "capture": Task(
        lambda: capture("default", "throughput"), starts=4, fresh=16, reference=(0.0, 0.0), scale=FULL_STREAM
    ),
    "capture fraction": Task(capture, starts=4, fresh=64),
    "blast": Task(lambda: blast("small"), starts=2, fresh=16),
    "avalanche": Task(avalanche, fresh=16),
    "mrf_shear": Task(lambda: mrf_shear(variant="bounded"), fresh=8),
    "valve": Task(lambda: valve(variant="field"), starts=4, fresh=16),
}
