"""Damping for zero restitution, and against the polynomial used by other codes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.effects.contact.compositions import NEUTRAL, grains, loaded
from tests.scenes import by_id, roundoff
from tisim import Material
from tisim.effects import HertzMaterial, RestitutionDamping
from tisim.materials.materials import Materials


@pytest.mark.slow
def test_zero_restitution_with_hookes_spring():
    """With e = 0, even in only one of two materials: the overlap is v t exp(-t sqrt(k / m*)), without
    rebound."""
    rate, v = (NEUTRAL["hooke"]["stiffness"] / 0.5) ** 0.5, 1.0
    made = grains("hooke", [[0, 0, 0], [2, 0, 0]], [[v / 2, 0, 0], [-v / 2, 0, 0]], material=[0, 1],
                  first={"restitution": 0.0}, dt=1e-3 / rate, steps=40_000)  # fmt: skip
    simulation = loaded([made])
    for turns in (0.5, 1.0, 3.0, 8.0):
        simulation.run(until=turns / rate)
        (result,) = simulation.results()
        state = by_id(result)
        overlap = 2 - np.diff(state["position"][:, 0])[0]
        approach = -np.diff(state["velocity"][:, 0])[0]
        assert overlap == pytest.approx(v * turns / rate * np.exp(-turns), rel=5e-3, abs=20 * roundoff())
        assert approach == pytest.approx(v * (1 - turns) * np.exp(-turns), abs=2e-3 * v)
    simulation.run()
    (result,) = simulation.results()
    # The rounding of positions, times the rate of this spring.
    assert np.abs(result.state["velocity"]).max() < 20 * rate * roundoff()


def test_tsujis_polynomial_is_a_fit_of_the_damping_by_restitution():
    """alpha(e) sqrt(m 4/3 E* a), with m = 2 m* for one of two equal grains, is the damping of a restitution
    that differs from e by at most 0.002 from e = 0.05 on, and by 0.014 at 0."""
    alpha = np.polynomial.Polynomial([1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218])
    e = np.append(0.0, np.linspace(0.05, 1, 20))
    (alike,) = Materials({"grain": Material(restitution=0.5)}, {}).touching()
    for wanted, size in zip(e, alpha(e) * (2 * 2 / 3) ** 0.5, strict=True):

        def excess(found, size=size):
            pair = replace(alike, first=Material(restitution=found), second=Material(restitution=found))
            (loss,) = RestitutionDamping().mix(pair).values()
            return HertzMaterial.restitution_factor * loss - size

        assert brentq(excess, 0, 1) == pytest.approx(wanted, abs=0.002 if wanted else 0.015)
