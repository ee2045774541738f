"""Chains of magnetic colloids, and the times at which the first of them reach the fibre: B16 section
6.4.6."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tisim import Result, RunError, Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import usual
from tisim.analysis import Mean, head_to_tail, labels, mean_size, near
from tisim.cases.case import Check, Claim
from tisim.cases.common.runs import grouped
from tisim.cases.concentration import scene as concentration
from tisim.cases.concentration.scene import chain_length, coupling
from tisim.scene.initial_state import Arrays

GAMMA = {25: 1.0, 125: 825.0}
"""The coupling Gamma of B16 Eq. (6.25) by radius in nm, as stated in its text."""
RADII = (25, 75, 125)
"""The radii of particles whose chains are compared, nm."""
CONTACT = 1.15
"""Largest distance of particles in contact, in diameters."""
CHAINS: dict[str, Any] = {"number": 48, "duration": 1e-3}
"""Settings for the formation of chains; nothing reaches the cylinder in this time, in which particles of 75
nm move 0.1 um."""
FORMING = 1e-4
"""A time at which the first chains have formed, but not all of them, s."""
CAPTURE: dict[str, Any] = {"number": 16, "duration": 0.45, "hydrodynamics": "rotne-prager", "coarse": 3.0}
LATE = 0.8
"""Time by which particles of dilute samples have also reached the cylinder, s."""
DILUTE, DENSE, DENSEST = 0.005, 0.5, 2.0
"""The compared concentrations, g/mL."""
ORIENTATIONS = {0.0: "longitudinal", 90.0: "transverse"}
"""The orientations of the cylinder by its angle to the field, degrees."""
MORE = 3
"""Factor on the number of starts for the smallest difference, 0.057 ± 0.015 s over 32 starts."""
NO_CAPTURE_BEFORE = 0.05
"""Time before which no particle of 75 nm is captured, s."""


def chain(state: Arrays, moment: np.ndarray) -> float:
    """Return the mean number of particles in a chain, including single particles."""
    diameter = 2 * float(state["radius"][0])
    return mean_size(len(moment), head_to_tail(state["position"], moment, diameter))


def grown(result: Result) -> float:
    """Return the growth of the mean chain since the start, at which some particles are in chains by
    chance."""
    moment = result.state["moment"]
    return chain(result.state, moment) - chain(result.start, moment)


def held_fraction(state: Arrays) -> float:
    """Return the fraction of the particles that are captured or connected by contacts to a captured one.

    A chain that stands on the cylinder touches it with only one particle.
    """
    reach = CONTACT * 2 * float(state["radius"][0])
    cluster = labels(len(state["position"]), near(state["position"], reach))
    return float(np.isin(cluster, cluster[state["fixed"] > 0]).mean())


def touched_fraction(state: Arrays) -> float:
    """Return the fraction of the particles that are captured."""
    return float((state["captured_at"] >= 0).mean())


def first(result: Result) -> float:
    """Return the time at which the first particle was captured, s; RunError if none was."""
    at = result.state["captured_at"]
    if not (at >= 0).any():
        raise RunError(f"{result.scene.name}: nothing is captured within {result.time:g} s")
    return float(at[at >= 0].min())


def firsts(group: Sequence[Result]) -> np.ndarray:
    """Return the time of the first capture in each of several runs, s."""
    return np.array([first(result) for result in group])


def results(settings: Sequence[dict[str, Any]], repeats: int) -> list[list[Result]]:
    """Return results of concentration for each setting, with the same number of starts each."""
    scenes = [concentration.scene(**setting, seed=seed) for setting in settings for seed in range(repeats)]
    return grouped(scenes, repeats)


def check(repeats: int = 4) -> Iterator[Check | Claim]:
    """Yield the checks of chains by size and concentration, and of capture by orientation and
    concentration."""
    for size, gamma in GAMMA.items():
        yield Check(f"{size} nm: Gamma (B16)", coupling(size), gamma, 0.01 * gamma)
    yield from of_chains(repeats)
    yield from of_capture(repeats)


def of_chains(repeats: int) -> Iterator[Claim]:
    """Yield the growth of chains for Gamma >> 1, their absence at 25 nm, and the effect of concentration at
    75 nm."""
    settings = [
        {"nanometres": size, "concentration": c, **CHAINS} for size in RADII for c in (DENSE, DENSEST)
    ]
    for setting, group in zip(settings, results(settings, repeats), strict=True):
        size, c = int(setting["nanometres"]), float(setting["concentration"])
        longer = Mean.of([grown(result) for result in group])
        name = (
            f"{size} nm, {c:g} g/mL: growth of the mean chain in 1 ms (Eq. 6.26: {chain_length(size, c):.1g})"
        )
        yield Claim(name, longer, most=0.5) if size == 25 else Claim(name, longer, least=1.0)
    early = [{"concentration": c, **CHAINS, "duration": FORMING} for c in (DENSE, DENSEST)]
    few, many = (
        np.array([chain(result.state, result.state["moment"]) for result in group])
        for group in results(early, repeats)
    )
    name = f"75 nm: mean chain after {FORMING:g} s, {DENSEST:g} g/mL minus {DENSE:g}"
    yield Claim(name, Mean.of(many - few), least=0.0)


def of_capture(repeats: int) -> Iterator[Claim]:
    """Yield the first captures of 75 nm particles with hydrodynamic interaction.

    Nothing is captured at first; the transverse cylinder takes almost twice as long; and the more
    concentrated sample is captured sooner. Start k has the same positions in all settings, so settings are
    compared start by start.
    """
    keys = [(angle, c) for angle in ORIENTATIONS for c in (DILUTE, DENSE)]
    settings = [
        {"angle": angle, "concentration": c, **CAPTURE, **({"duration": LATE} if c == DILUTE else {})}
        for angle, c in keys
    ]
    first_captures = dict(zip(keys, map(firsts, results(settings, repeats)), strict=True))
    along, across = first_captures[0.0, DENSE], first_captures[90.0, DENSE]
    name = "75 nm, 0.5 g/mL, longitudinal: first capture, s (B16 0.1 to 0.25)"
    yield Claim(name, Mean.of(along), least=NO_CAPTURE_BEFORE)
    yield Claim("the same: transverse over longitudinal (B16: almost 2)", Mean.of(across / along), least=1.5)
    by = f"first capture at {DENSE:g} g/mL, lead in s over"
    for (angle, name), lone in zip(ORIENTATIONS.items(), without_interaction(repeats), strict=True):
        late, soon = first_captures[angle, DILUTE], first_captures[angle, DENSE]
        yield Claim(f"{name}: {by} {DILUTE:g} g/mL", Mean.of(late - soon), least=0.0)
        than = f"{name}: {by} particles without interaction"
        yield Claim(than, Mean.of(lone - soon), least=0.0)
    across_both = [{"angle": 90.0, "concentration": c, **CAPTURE} for c in (DENSE, DENSEST)]
    dense, densest = map(firsts, results(across_both, MORE * repeats))
    name = f"transverse: first capture at {DENSEST:g} g/mL, lead in s over {DENSE:g} g/mL"
    yield Claim(name, Mean.of(dense - densest), least=0.0)


def without_interaction(repeats: int) -> list[np.ndarray]:
    """Return times of the first capture (s) without interaction, with the same number of particles, by
    angle."""
    setting = {**CAPTURE, "hydrodynamics": "none", "duration": 1.5, "concentration": DENSE}
    scenes = [
        concentration.scene(angle=angle, seed=seed, **setting).without("truncated_dipole_dipole", "mie")
        for angle in ORIENTATIONS for seed in range(repeats)
    ]  # fmt: skip
    return [firsts(group) for group in grouped(scenes, repeats)]


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: chain length and displacements of the particles.

    Capture begins only after some tenths of a second.
    """
    return (
        Quantity("mean chain", lambda result: chain(result.state, result.state["moment"]), random=True),
        *usual(scene),
    )
