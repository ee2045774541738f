"""Chains of magnetic colloids, and when the first of them reach the fibre: B16 section 6.4.6."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from tisim.cases.capture.statistics import grouped
from tisim.cases.case import Check
from tisim.cases.concentration import scene as concentration
from tisim.cases.concentration.scene import chain_length, coupling
from tisim.cases.statistics import Claim

from tisim import Result, RunError
from tisim.analysis import Mean, head_to_tail, labels, mean_size, near
from tisim.scene.initial_state import Arrays

GAMMA = {25: 1.0, 125: 825.0}
"""The coupling Gamma of B16 Eq. (6.25) by radius in nm, as the text gives it."""
RADII = (25, 75, 125)
"""The radii of particles whose chains are compared, nm."""
CONTACT = 1.15
"""Particles count as in contact within so many diameters."""
CHAINS: dict[str, Any] = {"number": 48, "duration": 1e-3}
"""While chains form, nothing comes near the cylinder: 75 nm go 0.1 um in that time."""
FORMING = 1e-4
"""The first chains have formed after this time, and not all of them, s."""
CAPTURE: dict[str, Any] = {"number": 16, "duration": 0.45, "hydrodynamics": "rotne-prager", "coarse": 3.0}
LATE = 0.8
"""By this time also dilute particles have reached the cylinder, s."""
DILUTE, DENSE, DENSEST = 0.005, 0.5, 2.0
"""The concentrations that are compared, g/mL."""
ORIENTATIONS = {0.0: "longitudinal", 90.0: "transverse"}
"""The orientations of the cylinder by its angle to the field, degrees."""
MORE = 3
"""What differs least, by 0.057 ± 0.015 s over 32 starts, is asked of so many times the starts of others."""
NO_CAPTURE_BEFORE = 0.05
"""Before this time none of 75 nm is captured, s."""


def chain(state: Arrays, moment: np.ndarray) -> float:
    """Mean number of particles of a chain, singles included."""
    diameter = 2 * float(state["radius"][0])
    return mean_size(len(moment), head_to_tail(state["position"], moment, diameter))


def grown(result: Result) -> float:
    """By how much chains are longer at the end than at the start, where some particles lie so by chance."""
    moment = result.state["moment"]
    return chain(result.state, moment) - chain(result.start, moment)


def held_fraction(state: Arrays) -> float:
    """Part of the particles that are captured, or hang on one that is, in contact with each other.

    A chain that stands on the cylinder touches it with one particle only.
    """
    reach = CONTACT * 2 * float(state["radius"][0])
    cluster = labels(len(state["position"]), near(state["position"], reach))
    return float(np.isin(cluster, cluster[state["fixed"] > 0]).mean())


def first(result: Result) -> float:
    """When the first particle was captured, s; RunError if none was."""
    at = result.state["captured_at"]
    if not (at >= 0).any():
        raise RunError(f"{result.scene.name}: nothing is captured within {result.time:g} s")
    return float(at[at >= 0].min())


def firsts(group: Sequence[Result]) -> np.ndarray:
    """When the first particle of each of several runs was captured, s."""
    return np.array([first(result) for result in group])


def results(settings: Sequence[dict[str, Any]], repeats: int) -> list[list[Result]]:
    """Results of the scene of concentration with each setting, from as many starts."""
    scenes = [concentration.scene(**setting, seed=seed) for setting in settings for seed in range(repeats)]
    return grouped(scenes, repeats)


def check(repeats: int = 4) -> Iterator[Check | Claim]:
    """Chains by size and concentration; capture by orientation and concentration."""
    for size, gamma in GAMMA.items():
        yield Check(f"{size} nm: Gamma (B16)", coupling(size), gamma, 0.01 * gamma)
    yield from of_chains(repeats)
    yield from of_capture(repeats)


def of_chains(repeats: int) -> Iterator[Claim]:
    """Chains for Gamma >> 1, none for 25 nm; of 75 nm more, where they are more concentrated."""
    settings = [
        {"nanometres": size, "concentration": c, **CHAINS} for size in RADII for c in (DENSE, DENSEST)
    ]
    for setting, group in zip(settings, results(settings, repeats), strict=True):
        size, c = int(setting["nanometres"]), float(setting["concentration"])
        longer = Mean.of([grown(result) for result in group])
        name = f"{size} nm, {c:g} g/mL: chains after 1 ms longer by (Eq. 6.26: {chain_length(size, c):.1g})"
        yield Claim(name, longer, most=0.5) if size == 25 else Claim(name, longer, least=1.0)
    early = [{"concentration": c, **CHAINS, "duration": FORMING} for c in (DENSE, DENSEST)]
    few, many = (
        np.array([chain(result.state, result.state["moment"]) for result in group])
        for group in results(early, repeats)
    )
    name = f"75 nm: mean chain after {FORMING:g} s, {DENSEST:g} g/mL minus {DENSE:g}"
    yield Claim(name, Mean.of(many - few), least=0.0)


def of_capture(repeats: int) -> Iterator[Claim]:
    """75 nm that feel each other's flow: nothing is captured at first; the transverse cylinder takes almost
    twice as long; and the more concentrated sample is captured sooner.

    Start k lies alike in all settings, so they are compared start by start.
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
    yield Claim("transverse over longitudinal (B16: almost 2)", Mean.of(across / along), least=1.5)
    by = f"first capture at {DENSE:g} g/mL, sooner by, s, than"
    for (angle, name), lone in zip(ORIENTATIONS.items(), without_interaction(repeats), strict=True):
        late, soon = first_captures[angle, DILUTE], first_captures[angle, DENSE]
        yield Claim(f"{name}: {by} at {DILUTE:g} g/mL", Mean.of(late - soon), least=0.0)
        than = f"{name}: {by} of particles that feel nothing of each other"
        yield Claim(than, Mean.of(lone - soon), least=0.0)
    across_both = [{"angle": 90.0, "concentration": c, **CAPTURE} for c in (DENSE, DENSEST)]
    dense, densest = map(firsts, results(across_both, MORE * repeats))
    name = f"transverse: first capture at {DENSEST:g} g/mL, sooner by, s, than at {DENSE:g} g/mL"
    yield Claim(name, Mean.of(dense - densest), least=0.0)


def without_interaction(repeats: int) -> list[np.ndarray]:
    """Times of the first capture (s) of as many particles that feel nothing of each other, by angle."""
    setting = {**CAPTURE, "hydrodynamics": "none", "duration": 1.5, "concentration": DENSE}
    scenes = [
        concentration.scene(angle=angle, seed=seed, **setting).without("truncated_dipole_dipole", "mie")
        for angle in ORIENTATIONS for seed in range(repeats)
    ]  # fmt: skip
    return [firsts(group) for group in grouped(scenes, repeats)]
