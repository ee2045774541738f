"""Agglomeration with charges and fields: forces beside NumPy, closed forms, conservation laws."""

import itertools

import numpy as np
import pytest
from scipy.constants import epsilon_0, mu_0
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.scenes import fixed, simulate
from tisim.cases.agglomeration import CASE, field_checks, fields
from tisim.cases.agglomeration.problem import problem
from tisim.cases.agglomeration.scene import BEST, HALF_SIDE, scene
from tisim.cases.agglomeration.what_fields_add import (
    FELT,
    KINDS_OF_GENES,
    Found,
    one_flow,
    picture,
    problem_of,
    table,
)
from tisim.effects import CARBONYL_IRON

DESIGN = {
    **BEST,
    "surface_charge": 3e-3, "charge_ratio": -0.6,
    "electric_field": 4e6, "electric_amplitude": 7e6, "electric_frequency": 300.0,
    "magnetic_field": 0.5, "magnetic_amplitude": 0.3, "magnetic_frequency": 120.0,
}  # fmt: skip
GRAINS = 12


def moment(flux, radius):
    """Magnetic moment of an iron sphere in a field along x, by Brent's method for Froehlich's law."""
    chi, saturation = CARBONYL_IRON.parameters().values()

    def excess(m):
        inside = flux / mu_0 - m / 3
        return chi * inside * (saturation - m) - saturation * m

    return 4 / 3 * np.pi * radius**3 * brentq(excess, 0.0, min(saturation, 3 * flux / mu_0), xtol=1e-6)


def forces_reference(design, state, t):
    """Coulomb and dipole forces of every pair with its nearest image, and the force of the electric field."""
    wave = np.sin(2 * np.pi * t * np.array([design["electric_frequency"], design["magnetic_frequency"]]))
    electric = design["electric_field"] + design["electric_amplitude"] * wave[0]
    flux = design["magnetic_field"] + design["magnetic_amplitude"] * wave[1]
    force = np.outer(state["charge"], [0.0, electric, 0.0])
    for i, j in itertools.permutations(range(len(force)), 2):
        apart = state["position"][j] - state["position"][i]
        apart -= 2 * HALF_SIDE * np.round(apart / (2 * HALF_SIDE))
        d = np.linalg.norm(apart)
        n = apart / d
        force[i] -= state["charge"][i] * state["charge"][j] / (4 * np.pi * epsilon_0 * d**2) * n
        a, b = (np.array([moment(flux, state["radius"][k]), 0.0, 0.0]) for k in (i, j))
        dipoles = (a @ n) * b + (b @ n) * a + (a @ b) * n - 5 * (a @ n) * (b @ n) * n
        force[i] -= 3 * mu_0 / (4 * np.pi * d**4) * dipoles
    return force


@pytest.mark.long
def test_the_forces_agree_with_a_numpy_reference():
    setup = scene(DESIGN, 3, GRAINS, duration=1e-12)
    (result,) = simulate([setup.model_copy(update={"stepper": fixed(1e-12)})])
    assert result.work["impacts"] == 0
    reference = forces_reference(DESIGN, result.state, result.time)
    assert np.abs(result.state["force"] - reference).max() <= 1e-10 * np.abs(reference).max()


@pytest.mark.long
def test_the_fields_oscillate():
    """After some steps the forces are in accord with the fields at that time."""
    setup = scene({**DESIGN, "relative_velocity": 20.0, "length_ratio": 0.2}, 3, GRAINS, duration=8e-5)
    (result,) = simulate([setup.model_copy(update={"stepper": fixed(2e-5)})])
    assert (result.work["steps"], result.work["impacts"]) == (4, 0)
    reference = forces_reference(DESIGN, result.state, result.time)
    still = forces_reference(DESIGN, result.state, 0.0)
    assert np.abs(result.state["force"] - reference).max() <= 1e-9 * np.abs(reference).max()
    assert np.abs(still - reference).max() > 1e-2 * np.abs(reference).max()


def test_grains_are_of_two_classes_that_differ_in_charge_alone():
    for grains in (60, 250):
        setup = scene(DESIGN, 1, grains)
        start = setup.particles.arrays(setup.domain, 1)
        plain = scene(BEST, 1, grains)
        without = plain.particles.arrays(plain.domain, 1)
        for name in ("velocity", "radius", "temperature"):
            assert (start[name] == without[name]).all()
        assert start["mass"] == pytest.approx(without["mass"], rel=1e-14)
        surface = start["charge"] / (4 * np.pi * start["radius"] ** 2)
        classes, counts = np.unique(surface.round(9), return_counts=True)
        assert classes == pytest.approx([-0.6 * 3e-3, 3e-3])
        assert counts.min() > 0.3 * grains


@pytest.mark.long
@pytest.mark.slow
def test_genes_without_charge_and_field_change_nothing():
    """The comparison is with the flow of Z04 in the same box with the same steps."""
    with_none = scene({**BEST, **fields.NO_FIELDS}, 2, 60, duration=1e-3)
    control = {"stepper": with_none.stepper, "domain": with_none.domain}
    a, b = (
        simulate([one])[0]
        for one in (with_none, scene(BEST, 2, 60, duration=1e-3).model_copy(update=control))
    )
    assert a.work["merges"] == b.work["merges"] > 5
    order = [np.argsort(one.state["id"]) for one in (a, b)]
    for name in ("position", "velocity", "radius", "temperature"):
        u, v = a.state[name][order[0]], b.state[name][order[1]]
        assert np.abs(u - v).max() <= 1e-12 * np.abs(v).max()


def integrated(acceleration, apart, distance):
    """Time (s) and speed (m/s) of a fall from rest, by integrating d'' = acceleration(d)."""

    def reached(t, y):
        return y[0] - distance

    reached.terminal = True
    end = solve_ivp(
        lambda t, y: (y[1], acceleration(y[0])), (0.0, 1.0), (apart, 0.0),
        events=reached, rtol=1e-11, atol=1e-15,
    )  # fmt: skip
    return end.t[-1], -end.y[1, -1]


def test_closed_forms_solve_the_equations_of_motion():
    mass, charge, magnet, apart, distance = 2e-5, 3e-8, 5e-3, 5e-3, 2e-3
    coulomb = charge**2 / (4 * np.pi * epsilon_0) / (mass / 2)
    time, _ = integrated(lambda d: -coulomb / d**2, apart, distance)
    assert field_checks.fall_time(mass, charge, apart, distance) == pytest.approx(time, rel=1e-8)
    dipoles = 3 * mu_0 * magnet**2 / (2 * np.pi) / (mass / 2)
    _, speed = integrated(lambda d: -dipoles / d**4, apart, distance)
    assert field_checks.dipole_speed(mass, magnet, apart, distance) == pytest.approx(speed, rel=1e-8)
    for flux in (1e-3, 0.4, 2.0):
        assert field_checks.iron_moment(flux) == pytest.approx(moment(flux, field_checks.RADIUS), rel=1e-9)


@pytest.mark.long
def test_two_charges_meet_at_the_time_of_the_closed_form_and_merge_to_zero_charge():
    time = field_checks.fall_time(
        field_checks.MASS, field_checks.CHARGE, field_checks.START_DISTANCE, 2 * field_checks.RADIUS
    )
    charges = (field_checks.CHARGE, -field_checks.CHARGE)
    steps = field_checks.OWN_STEPPER
    early, late = (
        simulate([field_checks.pair(field_checks.CHARGED, part * time, steps, charges)])[0]
        for part in (0.999, 1.001)
    )
    assert (early.work["merges"], late.work["merges"]) == (0, 1)
    assert late.state["charge"] == pytest.approx([0.0], abs=1e-14 * field_checks.CHARGE)
    assert late.state["mass"] == pytest.approx([2 * field_checks.MASS])


@pytest.mark.slow
def test_merging_conserves_charge_mass_and_momentum():
    checks = list(field_checks.conservation())
    assert all(check.ok for check in checks), checks
    merged = next(check for check in checks if "mergers" in check.name)
    assert merged.measured < 50


@pytest.mark.slow
def test_closed_forms():
    for check in field_checks.closed_forms():
        assert check.ok, check


def test_the_genome_has_velocity_hardness_reaction_charges_and_fields():
    assert "fields" in CASE.variants
    for size in CASE.sizes:
        searched, _ = CASE.inverse(size, "fields")
        names = set(searched.genome.names)
        assert {"relative_velocity", "hardness", "reaction", "surface_charge", "charge_ratio"} < names
        assert {f"{kind}_{what}" for kind in ("electric", "magnetic") for what in
                ("field", "amplitude", "frequency")} < names  # fmt: skip
        assert names == {*problem(size).genome.names, *fields.NO_FIELDS}
        low, high = (searched.scene(searched.genome.decode([u] * len(names)), 0) for u in (0.0, 1.0))
        assert low.structure() == high.structure()
        assert low.effects != high.effects


def test_a_search_without_genes_of_fields_has_no_fields():
    searched = problem_of("and magnetic field", "small")
    design = searched.genome.decode([0.5] * len(searched.genome))
    assert "surface_charge" not in design
    assert searched.scene(design, 4) == scene({**fields.NO_FIELDS, **design}, 4, 60)
    assert [len(problem_of(kind, "small").genome) for kind in KINDS_OF_GENES] == [10, 12, 15, 13, 18]


def test_the_table_and_the_picture_of_the_effect_of_fields():
    found = {
        kind: [Found({}, 0.1 * k, true) for true in (0.2, 0.3, 0.4)] for k, kind in enumerate(KINDS_OF_GENES)
    }
    text = table(found)
    assert text.count("0.300 ± 0.248") == len(KINDS_OF_GENES)
    assert "| all | 18 | 0.300 ± 0.248 | 0.400 |" in text
    (axis,) = picture(found, "three").axes
    assert [label.get_text() for label in axis.get_yticklabels()] == list(KINDS_OF_GENES)


@pytest.mark.slow
def test_the_effect_of_fields_on_one_flow_is_compared_for_the_same_starts():
    head, _, *rows = one_flow(60, 48).splitlines()
    assert head.split("|")[1].strip() == "grains feel"
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows]
    assert [row[0] for row in cells] == list(FELT)
    assert cells[0][2] == ""
    gain, half = (float(part) for part in cells[-2][2].split(" ± "))
    assert gain - half > 0.02


@pytest.mark.parametrize(
    "felt",
    [
        {"surface_charge": 3e-3, "charge_ratio": -1.0},
        {"magnetic_field": 1.0},
        {"surface_charge": 1e-3, "charge_ratio": 0.0, "electric_field": 5e6, "electric_amplitude": 2e6},
    ],
    ids=["charges", "moments", "electric field"],
)
def test_the_rate_follows_from_two_touching_grains(felt):
    """The square of the rate is their acceleration over the radius, with charges of both classes and moments
    in line; for an electric field alone the largest charge counts."""
    radius, design = 1e-3, {**BEST, **fields.NO_FIELDS, **felt}
    mass = 4 / 3 * np.pi * radius**3 * design["density"]
    charge = 4 * np.pi * radius**2 * design["surface_charge"]
    m = moment(design["magnetic_field"], radius) if design["magnetic_field"] else 0.0
    force = charge**2 / (4 * np.pi * epsilon_0 * 4 * radius**2) + 6 * mu_0 * m**2 / (
        4 * np.pi * 16 * radius**4
    )
    force += charge * (design["electric_field"] + design["electric_amplitude"])
    exact = np.sqrt(force / mass / radius)
    # Iron at 1 T is not quite saturated.
    assert 0.999 * exact < fields.rate(design, radius) < (1.15 if m else 1.001) * exact
    assert fields.rate({**design, **fields.NO_FIELDS}, radius) == 0.0


def test_steps_of_small_grains_in_strong_fields_may_be_shorter_than_in_the_paper():
    strong = {**BEST, **FELT["opposite charges"], "magnetic_field": 1.0, "density": 1e3, "length_ratio": 0.4}
    control = scene({**fields.NO_FIELDS, **strong}, 1, 1000).stepper.control
    assert control.shortest == control.longest < 1e-6
    weak = scene(
        {**fields.NO_FIELDS, **strong, "surface_charge": 1e-9, "magnetic_field": 0.0}, 1, 60
    ).stepper.control
    assert (weak.shortest, weak.longest) == (1e-6, 1e-3)
