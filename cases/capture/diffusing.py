"""Brownian particles in the case capture: free ones that diffuse rather than being attracted (B16 6.4.4)."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.constants import k as BOLTZMANN

from tisim import Result
from tisim.analysis import Mean
from tisim.sources import MagneticCylinders
from tisim.steppers import Brownian

DISPLACED = 2.0
"""The factor of the mean squared displacement in B16 (6.24)."""
FREE = math.erf(math.sqrt(3 * DISPLACED / 2)) - math.sqrt(6 * DISPLACED / math.pi) * math.exp(
    -3 * DISPLACED / 2
)
"""The part of particles without any force that fulfil B16 (6.24): the probability that chi^2 of three degrees
of freedom, r^2/(2 D t), is below 3 DISPLACED. It is 0.888, not 1."""

Part = Literal["all", "top", "side"]


def squared_displacement(result: Result) -> np.ndarray:
    """Return the squared distance of each particle from where it started, m^2, in the order of ids."""
    order = np.argsort(result.state["id"])
    return ((result.state["position"][order] - result.start["position"]) ** 2).sum(axis=1)


def diffuses(result: Result) -> np.ndarray:
    """Return whether each particle fulfils B16 (6.24), r^2 < 2 (6 D t), in the order of ids.

    t is the time of the run and D = k T / (6 pi eta R). B16 writes means, but decides for each particle.
    """
    stepper = result.scene.stepper
    assert isinstance(stepper, Brownian)
    diffusion = BOLTZMANN * stepper.temperature / (6 * np.pi * stepper.viscosity * result.start["radius"])
    return squared_displacement(result) < DISPLACED * 6 * diffusion * result.time


def brownian(result: Result, part: Part = "all", free: bool = True) -> np.ndarray:
    """Return whether each particle of a start region is Brownian at the end, by B16 (6.24).

    free : a captured particle is never Brownian. Otherwise it is if it has started close to the cylinder, so
        that its way to the surface was short.
    """
    found = diffuses(result)
    if free:
        found &= ~(result.state["captured_at"][np.argsort(result.state["id"])] >= 0)
    return found[started_in(result, part)]


def started_in(result: Result, part: Part) -> np.ndarray:
    """Return whether each particle has started in a region of B16 Fig. 6.2, in the order of ids."""
    place = result.start["position"]
    if part == "all":
        return np.ones(len(place), bool)
    body = next(e for e in result.scene.effects if isinstance(e, MagneticCylinders)).cylinders[0]
    top = np.abs(place @ np.array(body.direction)) > body.length / 2 + result.start["radius"]
    return top if part == "top" else ~top


def brownian_fraction(group: Sequence[Result], part: Part = "all", free: bool = True) -> Mean:
    """Return the Brownian fraction of the particles of a start region, a ratio of means over the starts.

    A start has b Brownian particles among the n of the region. The fraction is f = mean(b) / mean(n), and the
    half width of its interval is the half width for the mean of b - f n, divided by mean(n).
    """
    found = [brownian(result, part, free) for result in group]
    number, number_brownian = (np.array([f(one) for one in found], float) for f in (len, np.sum))
    fraction = float(number_brownian.sum() / number.sum())
    half = Mean.of(number_brownian - fraction * number).half / float(number.mean())
    return Mean(fraction, half)
