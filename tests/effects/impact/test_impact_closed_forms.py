"""Impact of two equal grains against the closed forms of Z04, and pairs without an impact."""

import numpy as np
import pytest

from tests.effects.impact.impact_reference import COMBINATIONS, PAIRS, draw, effects
from tests.scenes import head_on, scene, simulate
from tisim.effects import Impact


def restitution(result, speed):
    v = result.state["velocity"][:, 0]
    return (v[1] - v[0]) / (2 * speed)


@pytest.mark.long
def test_restitution_of_equal_grains_closed_form():
    """Z04 (4.13)-(4.14) with a_0 = 0, a_f = 1: e = 1 - v/v*, v* = sqrt(3 H beta / (2 rho)), 0 above."""
    cases = []
    for hardness, beta, density in ((1e5, 1.0, 2000.0), (1e6, 0.5, 1e4), (3e5, 2.0, 1e3)):
        critical = np.sqrt(3 * hardness * beta / (2 * density))
        for part in (1e-3, 0.2, 0.7, 0.999, 1.5):
            cases.append((hardness, beta, density, part, part * critical))
    results = simulate(
        [
            head_on(v, (Impact(hardness=h, deformation_length=beta),), density=density, dt=1e-12)
            for h, beta, density, _, v in cases
        ],
        worlds=PAIRS,
        capacity=2,
    )
    for (*_, part, v), result in zip(cases, results, strict=True):
        assert restitution(result, v) == pytest.approx(max(1 - part, 0), abs=1e-10)
        assert result.work["bonds"] == (part > 1)


def test_restitution_for_any_contact_areas_closed_form():
    """Z04 (4.13): D e^2 - (a_f + D) e + a_f - A = 0, D = a_f - a_0, A = 2 rho v^2 / (3 beta H)."""
    hardness, density, beta = 2e5, 3000.0, 0.8
    cases = [
        (a0, af, v)
        for a0, af in ((0.0, 1.0), (0.2, 0.9), (0.5, 0.5), (0.0, 0.3))
        for v in (0.5, 2.0, 4.0, 40.0)
    ]
    results = simulate(
        [
            head_on(
                v,
                (Impact(hardness=hardness, deformation_length=beta, initial_area=a0, final_area=af),),
                density=density,
                dt=1e-12,
            )
            for a0, af, v in cases
        ],
        worlds=PAIRS,
        capacity=2,
    )
    for (a0, af, v), result in zip(cases, results, strict=True):
        d, a = af - a0, 2 * density * v**2 / (3 * beta * hardness)
        roots = np.roots([d, -(af + d), af - a]) if d else np.array([(af - a) / af])
        expected = max(roots.real.min(), 0.0) if np.isreal(roots).all() else 0.0
        assert restitution(result, v) == pytest.approx(expected, abs=1e-10)


def test_adhesion_speed_closed_form():
    """Z04 (4.15): equal grains bond from v = sqrt(3 a_f H beta / (2 rho)) on, to a relative error
    of 1e-10."""
    hardness, density, beta, af = 2e5, 3000.0, 0.8, 0.7
    critical = np.sqrt(3 * af * hardness * beta / (2 * density))
    law = (Impact(hardness=hardness, deformation_length=beta, final_area=af),)
    below, above = simulate(
        [head_on(critical * (1 + off), law, density=density, dt=1e-12) for off in (-1e-10, 1e-10)],
        worlds=PAIRS,
        capacity=2,
    )
    assert below.work["bonds"] == 0
    assert above.work["bonds"] == 1


@pytest.mark.slow
def test_harder_or_lighter_or_slower_never_bonds_more(rng):
    """x = 1 - e rises with approach speed; a pair that bonds at one speed bonds at every higher one."""
    pair = draw(rng)
    speeds = np.geomspace(0.1, 1e4, PAIRS)
    law = effects(pair, COMBINATIONS["all"])
    results = simulate(
        [head_on(v, law, density=4000.0, dt=1e-13, quantities={"temperature": 300.0}) for v in speeds],
        worlds=PAIRS,
        capacity=2,
    )
    e = np.array([restitution(result, v) for result, v in zip(results, speeds, strict=True)])
    assert (np.diff(e) <= 1e-12).all()
    assert e[0] > 0.9
    assert e[-1] == pytest.approx(0, abs=1e-14)


def test_pairs_that_separate_or_do_not_touch_are_unchanged():
    """An impact needs both an overlap and an approach."""
    apart, parting = simulate(
        [
            scene([[0, 0, 0], [2.1e-3, 0, 0]], [[1, 0, 0], [0, 0, 0]], (Impact(hardness=1e5),)),
            scene([[0, 0, 0], [1.9e-3, 0, 0]], [[-1, 0, 0], [0, 0, 0]], (Impact(hardness=1e5),)),
        ],
        worlds=PAIRS,
        capacity=2,
    )
    for result in (apart, parting):
        assert result.work["impacts"] == 0
        np.testing.assert_array_equal(result.state["velocity"], result.start["velocity"])
