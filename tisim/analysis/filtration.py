"""Which particles a filter has captured and which have passed it: by time and by size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import beta

from tisim.analysis.mean import Mean
from tisim.errors import must
from tisim.numerics.statistics import CONFIDENCE


@dataclass(frozen=True)
class Fractions:
    """Fractions of independent particles in classes, with exact 95 % intervals (C. J. Clopper, E. S. Pearson,
    Biometrika 26 (1934) 404).

    edges : of the classes, shape (n + 1,), in the unit of the classed quantity. number : particles in each
    class, shape (n,). found : those of them that are counted. value, low, high : the fraction, NaN for an
    empty class, and the ends of its interval, 0 and 1 for an empty class.
    """

    edges: np.ndarray
    number: np.ndarray
    found: np.ndarray
    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class BreakthroughCurve:
    """The concentration at the outlet over the concentration of the feed, in intervals of time.

    time : edges of the intervals, s, shape (n + 1,). number : particles that left in each, shape (n,).
    value, low, high : relative concentration, and the ends of its exact 95 % interval.
    """

    time: np.ndarray
    number: np.ndarray
    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Balance:
    """The numbers of particles of a filter at one time: those that have entered are out, captured or free.

    given : particles that were inside at the start. entered, exited, captures, releases : counts of events.
    waiting, captured, free : particles that are at the inlet, captured, or free inside.
    """

    given: int
    entered: int
    exited: int
    captures: int
    releases: int
    waiting: int
    captured: int
    free: int

    @property
    def missing(self) -> int:
        """Return the number of particles that entered or were inside, less those that are out, captured or
        free; 0 if none is lost."""
        return self.given + self.entered - self.exited - self.captured - self.free


def captured_by_size(radius: ArrayLike, captured: ArrayLike, edges: ArrayLike) -> Fractions:
    """Return the captured fraction of particles in classes of size.

    radius : m, shape (n,). captured : whether each is captured, shape (n,). edges : of the classes,
    increasing, m; a class includes its lower edge, the last one both.
    InputError is raised for arrays of different lengths, or for edges that do not increase.
    """
    radii, chosen = np.asarray(radius, float), np.asarray(captured, bool)
    must(radii.shape == chosen.shape and radii.ndim == 1, "captured", f"of shape {radii.shape}", chosen.shape)
    bounds = _edges(edges)
    number, found = np.histogram(radii, bounds)[0], np.histogram(radii[chosen], bounds)[0]
    low, high = _interval(found, number)
    with np.errstate(invalid="ignore"):
        return Fractions(bounds, number, found, found / number, low, high)


def breakthrough_curve(exited_at: ArrayLike, edges: ArrayLike, fed: int, feeding: float) -> BreakthroughCurve:
    """Return the concentration at the outlet relative to the feed, from the times at which particles left.

        c/c_0 = (number out) / (fed dt / feeding)

    The flow is the same at both ends, and the feed has a uniform rate. exited_at : times, s, such as the
    field ``exited_at``; negative for particles that have not left, shape (n,). edges : of the intervals of
    time, increasing, s. fed : number of particles in the whole feed. feeding : duration of the feed, s, the
    ``end`` of an inlet less its ``begin``. Given the number fed, the number that leaves in an interval is
    binomial.
    InputError is raised for edges that do not increase, or if fewer particles were fed than have left.
    """
    times = np.asarray(exited_at, float)
    bounds, left = _edges(edges), times[times >= 0]
    must(fed >= max(len(left), 1), "fed", f"at least {max(len(left), 1)}", fed)
    must(feeding > 0, "feeding", "above 0 s", feeding)
    number = np.histogram(left, bounds)[0]
    scale = feeding / np.diff(bounds)
    low, high = _interval(number, np.full(len(number), fed))
    return BreakthroughCurve(bounds, number, scale * number / fed, scale * low, scale * high)


def mean_core_radius(saturation_moment: ArrayLike, magnetisation: float) -> Mean:
    """Return the mean magnetic radius (m) of particles, by number, with its 95 % interval.

        r = (3 m_s / (4 pi M_s))^(1/3)

    saturation_moment : m_s of each, A m^2, shape (n,), at least one. magnetisation : M_s of the material,
    A/m. The particles are a sample of independent ones.

    Source: B16 Eq. (7.6).
    """
    must(magnetisation > 0, "magnetisation", "above 0 A/m", magnetisation)
    return Mean.of(np.cbrt(3 * np.asarray(saturation_moment, float) / (4 * np.pi * magnetisation)))


def particle_balance(work: Mapping[str, int], state: Mapping[str, np.ndarray]) -> Balance:
    """Return the numbers of particles that entered, left, are captured, or are free.

    work, state : of a Result, for a scene with ``inlet``, ``outlet`` or ``capture``. The counts of events
    come from ``work`` alone, the numbers of captured and free particles from ``state`` alone.
    """
    n, none = len(state["mass"]), np.full(len(state["mass"]), -1)
    waiting = state.get("entered_at", np.zeros(n)) < 0
    exited = state.get("exited_at", none) >= 0
    captured = state.get("captured_by", none) >= 0
    counts = {name: int(work.get(name, 0)) for name in ("entered", "exited", "captures", "releases")}
    # Particles that have entered have taken at least one trial.
    given = ~waiting & (state.get("entry_trials", np.zeros(n)) == 0)
    return Balance(
        given=int(given.sum()),
        **counts,
        waiting=int(waiting.sum()),
        captured=int(captured.sum()),
        free=int((~(waiting | exited | captured)).sum()),
    )


def _edges(edges: ArrayLike) -> np.ndarray:
    bounds = np.asarray(edges, float)
    rising = bounds.ndim == 1 and len(bounds) > 1 and bool((np.diff(bounds) > 0).all())
    must(rising, "edges", "at least two increasing numbers", edges)
    return bounds


def _interval(found: np.ndarray, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the exact interval of the probability of which ``found`` among ``number`` is an
    outcome."""
    tail = (1 - CONFIDENCE) / 2
    rest = number - found
    low = np.where(found > 0, beta.ppf(tail, np.maximum(found, 1), rest + 1), 0.0)
    high = np.where(rest > 0, beta.ppf(1 - tail, found + 1, np.maximum(rest, 1)), 1.0)
    return low, high
