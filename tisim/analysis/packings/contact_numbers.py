"""Mean contact numbers of packings, extrapolated to contact, with and without rattlers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import linregress
from scipy.stats import t as student

from tisim.analysis.beds import FEWEST_CONTACTS, rattling
from tisim.analysis.flow_curves import Estimate
from tisim.analysis.packings.gaps import near_gaps, relative_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.errors import must
from tisim.numerics.statistics import CONFIDENCE

CONTACT_CUTOFFS = tuple(np.geomspace(1e-8, 1e-5, 31).tolist())
"""Cut-offs of B16 2.2.5, in D."""


class ContactNumbers(NamedTuple):
    """Mean contact numbers at cut-offs.

    cutoff : largest gaps that count as contacts, in D of the smaller body of a pair, shape (k,).
    mean : mean contact number of all bodies, shape (k,).
    held_mean : mean number of contacts of the bodies that are not rattlers with each other; NaN if all are
    rattlers, shape (k,).
    rattlers : number of rattlers, shape (k,).
    at_contact, held_at_contact : both means, extrapolated linearly to a cut-off of 0. The interval comes from
    the scatter about the line and tells whether the contact number is a line in the cut-off. It does not
    contain the scatter from packing to packing, for which there is ``Mean.of``.
    """

    cutoff: np.ndarray
    mean: np.ndarray
    held_mean: np.ndarray
    rattlers: np.ndarray
    at_contact: Estimate
    held_at_contact: Estimate


def contact_numbers(
    packing: PackedBodies, cutoffs: ArrayLike = CONTACT_CUTOFFS, fewest: int = FEWEST_CONTACTS
) -> ContactNumbers:
    """Return mean contact numbers of a packing: twice the number of pairs with a gap of at most a cut-off,
    over the number of bodies, for at least three cut-offs (in D). Pairs that overlap are in contact.

    fewest : a body with fewer contacts with bodies that are not rattlers is a rattler. No fewer than four
        frictionless contacts can hold a sphere, and four can hold a smooth body of another shape if its
        curvature helps; without this it takes one more than it has degrees of freedom.

    Source: B16 section 2.2.5, after A. Wouterse, S. R. Williams, A. P. Philipse, J. Phys.: Condens. Matter 19
    (2007) 406215; for the rule of four contacts A. Donev et al., Phys. Rev. E 75 (2007) 051304.
    """
    cutoff = np.sort(np.asarray(cutoffs, float).ravel())
    rising = len(cutoff) > 2 and cutoff[0] >= 0 and bool((np.diff(cutoff) > 0).all())
    must(rising, "cutoffs", "at least three different numbers from 0 on", cutoffs)
    number = len(packing)
    must(number > 0, "bodies", "at least one", number)
    gaps = near_gaps(packing, float(cutoff[-1] * packing.diameters().max()))
    relative = relative_gaps(packing, gaps)
    mean, held_mean, rattlers = (np.zeros(len(cutoff)) for _ in range(3))
    for k, largest in enumerate(cutoff):
        pairs = gaps.pairs[relative <= largest]
        held = ~rattling(number, pairs, fewest)
        left = int(held.sum())
        mean[k], rattlers[k] = 2 * len(pairs) / number, number - left
        held_mean[k] = 2 * held[pairs].all(axis=1).sum() / left if left else np.nan
    both = (_at_zero(cutoff, values) for values in (mean, held_mean))
    return ContactNumbers(cutoff, mean, held_mean, rattlers.astype(int), *both)


def _at_zero(cutoff: np.ndarray, mean: np.ndarray) -> Estimate:
    """Return the intercept of the line through mean contact numbers, by least squares."""
    known = np.isfinite(mean)
    if known.sum() < 3:
        return Estimate(float("nan"), float("inf"))
    fit = linregress(cutoff[known], mean[known])
    width = student.ppf(0.5 + CONFIDENCE / 2, int(known.sum()) - 2) * fit.intercept_stderr
    return Estimate(float(fit.intercept), float(width))
