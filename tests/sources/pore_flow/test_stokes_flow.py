"""Slow flow through matrices compared with closed forms, published lattices, and a direct solution of the
same equations."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from tests.sources.pore_flow import lattices
from tisim import InputError
from tisim.sources import SolidCylinder, SolidSphere, permeability_tensor, stokes_flow

UNIT = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
TIGHT = 1e-7
TILTED = SolidCylinder((0.52, 0.45, 0.55), tuple(np.array([2.0, 1.0, -2.0]) / 3), 0.17, 0.9)
"""A fibre at no special place, which crosses faces of the box."""
FIBRES = [TILTED, SolidSphere((0.05, 0.9, 0.1), 0.2)]


def flow(solids, cells, fall=(0.0, 0.0, 1.0), **options):
    return stokes_flow(solids, *UNIT, cells, tuple(-np.array(fall)), 1.0, **options)


def errors(found, expected):
    return [one / expected - 1 for one in found]


def order(errors, ratio=2):
    """The order of convergence from the first to the last of some resolutions, each ``ratio`` times finer."""
    return np.log(abs(errors[0] / errors[-1])) / ((len(errors) - 1) * np.log(ratio))


def test_between_plates_the_flow_is_plane_poiseuille():
    """k = d^2/12 times the open part, by a slab of solid cylinders that overlap; for any place of the walls
    among the faces."""
    for shift in (0.0, 0.013, 0.04):
        k = []
        for n in (16, 32, 64):
            gap = 0.6
            wall = SolidCylinder((0.5 + shift, 0.5, 0.5), (1.0, 0.0, 0.0), 3.0, 1 - gap)
            found = flow([wall], (n, 4, 1))
            k.append(found.permeability)
        wrong = errors(k, gap**3 / 12)
        assert abs(wrong[-1]) < 1.1e-3
        assert order(wrong) > 1.7


@pytest.mark.parametrize("shift", [0.0, 0.021])
def test_the_profile_between_plates_is_a_parabola(shift):
    """At every face, up to the constant h^2/8 of the nodes next to the wall."""
    n, gap = 50, 0.6
    wall = SolidCylinder((0.5 + shift, 0.5, 0.5), (1.0, 0.0, 0.0), 3.0, 1 - gap)
    found = flow([wall], (n, 4, 1), tolerance=TIGHT)
    x = ((np.arange(n) + 0.5) / n - shift - 0.7) % 1
    parabola = np.where(x < gap, x * (gap - x) / 2, 0)
    np.testing.assert_allclose(found.velocity[2, :, 0, 0], parabola, atol=1.0001 / (8 * n**2))
    assert abs(found.velocity[:2]).max() < 1e-9


def test_ducts_and_tubes_have_their_closed_forms():
    """Square duct: k = (1/12) (1 - 192/pi^5 sum tanh(j pi/2)/j^5), j odd. Tube: k = pi/4 R^2/8."""
    odd = np.arange(1, 100, 2)
    duct = (1 - 192 / np.pi**5 * (np.tanh(odd * np.pi / 2) / odd**5).sum()) / 12
    for column, exact in (("duct", duct), ("tube", np.pi / 128)):
        k = [flow([], (n, n, 1), column=column, axis=2).permeability for n in (16, 32, 64)]
        wrong = errors(k, exact)
        assert abs(wrong[-1]) < 1.2e-3, column
        assert order(wrong) > 1.9, column


def test_a_duct_is_open_along_each_axis():
    k = [
        flow([], np.roll((8, 8, 4), a + 1), np.eye(3)[a], column="duct", axis=a, tolerance=TIGHT).permeability
        for a in range(3)
    ]
    np.testing.assert_allclose(k, k[0], rtol=1e-10)


@pytest.mark.parametrize("fraction", [0.1, 0.3, 0.5])
def test_flow_along_cylinders_is_the_series_solution(fraction):
    for neighbours in (4, 6):
        wrong = []
        for n in (16, 64):
            hexagonal = neighbours == 6
            solids = lattices.hexagonal(fraction) if hexagonal else lattices.square(fraction, (0.2, 0.3))
            side = np.sqrt(3) if hexagonal else 1.0
            high, cells = (1.0, side, 1.0), (n, round(side * n), 1)
            found = stokes_flow(solids, (0, 0, 0), high, cells, (0, 0, -1), 1.0, tolerance=1e-5)
            wrong.append(found.permeability / lattices.along(fraction, neighbours) - 1)
        assert abs(wrong[-1]) < 2.5e-3
        assert order(wrong, 4) > 1.7


@pytest.mark.parametrize("fraction", [0.05, 0.1, 0.2, 0.3, 0.4, 0.5])
def test_flow_across_a_square_array_has_the_published_drag(fraction):
    """Force per length over eta U = 1/k for a cell of side 1; the error falls to 0.3 % at 64 cells."""
    wrong = []
    for n in (16, 64):
        found = flow(lattices.square(fraction, (0.2, 0.3)), (n, n, 1), (1.0, 0.0, 0.0))
        wrong.append(found.permeability * lattices.SANGANI_ACRIVOS[fraction] - 1)
    assert abs(wrong[0]) < 0.06
    assert abs(wrong[1]) < 3e-3


def test_flow_across_a_hexagonal_array_has_the_published_drag_and_is_isotropic():
    high, cells = (1.0, np.sqrt(3), 1.0), (48, 83, 1)
    k = [
        stokes_flow(lattices.hexagonal(0.1), (0, 0, 0), high, cells, g, 1.0).permeability
        for g in ((-1, 0, 0), (0, -1, 0))
    ]
    assert k[1] == pytest.approx(k[0], rel=2e-3)
    # The cell holds two cylinders.
    assert k[0] * 2 * lattices.across_hexagonal(0.1) / np.sqrt(3) == pytest.approx(1, rel=3e-3)


def test_a_dense_lattice_of_spheres_has_the_published_drag():
    for fraction, limit in ((0.027, 0.008), (0.216, 0.008), (0.45, 0.014)):
        drag = lattices.ZICK_HOMSY["simple cubic", fraction]
        exact = lattices.sphere_permeability("simple cubic", fraction, drag)
        k = flow(lattices.spheres("simple cubic", fraction, (0.01, 0.03, 0.02)), (32, 32, 32)).permeability
        assert k == pytest.approx(exact, rel=limit)


@pytest.mark.slow
@pytest.mark.parametrize(("lattice", "fraction"), list(lattices.ZICK_HOMSY))
def test_lattices_of_spheres_have_the_published_drag(lattice, fraction):
    """Also spheres that touch, between which the fluid fills gaps narrower than cells."""
    exact = lattices.sphere_permeability(lattice, fraction, lattices.ZICK_HOMSY[lattice, fraction])
    wrong = [
        flow(lattices.spheres(lattice, fraction, (0.01, 0.03, 0.02)), (n, n, n)).permeability / exact - 1
        for n in (32, 64)
    ]
    assert abs(wrong[1]) < (0.012 if lattice != "simple cubic" else 0.004)
    assert abs(wrong[1]) < abs(wrong[0])


@pytest.mark.parametrize("lattice", list(lattices.SPHERES))
def test_dilute_lattices_follow_hasimoto(lattice):
    a, b = lattices.HASIMOTO[lattice]
    fraction = 0.04
    drag = 1 / (1 - a * fraction ** (1 / 3) + fraction - b * fraction**2)
    exact = lattices.sphere_permeability(lattice, fraction, drag)
    k = flow(lattices.spheres(lattice, fraction), (48, 48, 48)).permeability
    assert k == pytest.approx(exact, rel=8e-3)


@pytest.mark.slow
def test_permeability_is_second_order_accurate():
    """From 16 to 64 cells, for four places of a lattice among the cells."""
    exact = lattices.sphere_permeability("simple cubic", 0.125, 4.292)
    generator = np.random.default_rng(1)
    for _ in range(4):
        shift = generator.uniform(size=3)
        wrong = [
            flow(lattices.spheres("simple cubic", 0.125, shift), (n, n, n)).permeability / exact - 1
            for n in (16, 32, 64)
        ]
        assert order(wrong) > 1.8
        assert abs(wrong[-1]) < 1e-3


def test_velocity_is_free_of_divergence_and_zero_at_walls():
    found = flow(FIBRES, (24, 20, 28), (1.0, -0.5, 0.3), tolerance=1e-6)
    speed = np.linalg.norm(found.mean_velocity)
    assert abs(found.divergence()).max() < 1e-11 * speed * 28
    assert np.sqrt((found.velocity[found.solid] ** 2).mean()) < 3e-6 * speed
    assert abs(found.velocity[found.solid]).max() < 3e-5 * speed
    np.testing.assert_allclose(found.velocity.mean(axis=(1, 2, 3)), found.mean_velocity, rtol=1e-9)
    assert found.residual <= 1e-6


def test_viscosity_dissipates_the_work_of_the_pressure_gradient():
    for solids, options in ((FIBRES, {}), (FIBRES, {"column": "duct"}), ([], {"column": "tube"})):
        found = flow(solids, (20, 20, 20), tolerance=TIGHT, **options)
        assert found.dissipation() == pytest.approx(found.work(), rel=3e-8)


def test_the_error_of_permeability_is_quadratic_in_the_tolerance():
    fine = flow(FIBRES, (20, 20, 20), tolerance=TIGHT).permeability
    for tolerance in (1e-3, 1e-4):
        coarse = flow(FIBRES, (20, 20, 20), tolerance=tolerance).permeability
        assert abs(coarse / fine - 1) < 100 * tolerance**2


def test_permeability_is_a_symmetric_tensor_and_the_flow_linear():
    tensor = permeability_tensor(FIBRES, *UNIT, (20, 20, 20), tolerance=TIGHT)
    assert abs(tensor - tensor.T).max() < 1e-7 * tensor.trace()
    assert np.linalg.eigvalsh(tensor).min() > 0
    assert abs(tensor - np.diag(tensor.diagonal())).max() > 1e-3 * tensor.trace()
    fall = np.array([0.3, -1.0, 2.0])
    found = stokes_flow(FIBRES, *UNIT, (20, 20, 20), tuple(-7 * fall), 5.0, tolerance=TIGHT)
    np.testing.assert_allclose(found.mean_velocity, 7 / 5 * tensor @ fall, rtol=1e-6)


def test_result_does_not_depend_on_the_origin_of_the_box():
    """Bodies are moved by whole cells, across faces of the box."""
    cells = (18, 20, 16)
    first = flow(FIBRES, cells, (1.0, 0.0, 0.0), tolerance=TIGHT)
    shift = np.array([7, -9, 13])
    moved = [
        SolidCylinder(tuple(TILTED.centre + shift / cells), TILTED.axis, TILTED.radius, TILTED.length),
        SolidSphere(tuple(FIBRES[1].centre + shift / cells), FIBRES[1].radius),
    ]
    second = flow(moved, cells, (1.0, 0.0, 0.0), tolerance=TIGHT)
    assert second.permeability == pytest.approx(first.permeability, rel=1e-9)
    np.testing.assert_allclose(
        second.velocity, np.roll(first.velocity, shift, (1, 2, 3)), atol=1e-6 * first.mean_velocity[0]
    )


def test_lengths_viscosity_and_gradient_scale():
    """Bodies of 1e-4 m in water: k by the square of length, U by the gradient over the viscosity."""
    one = flow([SolidSphere((0.5, 0.5, 0.5), 0.3)], (12, 12, 12), tolerance=TIGHT)
    size = 3e-4
    small = stokes_flow(
        [SolidSphere((size, size / 2, size / 2), 0.3 * size)],
        (size / 2, 0, 0), (1.5 * size, size, size), (12, 12, 12), (0, 0, -2e3), 1e-3, tolerance=TIGHT,
    )  # fmt: skip
    assert small.permeability == pytest.approx(size**2 * one.permeability, rel=1e-10)
    speed = one.mean_velocity[2] * size**2 * 2e3 / 1e-3
    np.testing.assert_allclose(small.mean_velocity, [0, 0, speed], rtol=1e-10, atol=1e-6 * speed)
    np.testing.assert_allclose(small.pressure, one.pressure * 2e3 * size, rtol=0, atol=1e-6)


def direct(solids, cells, fall, spacing):
    """Velocities on faces, by a sparse direct solution of the equations for velocity and pressure.

    Fluid faces: sum over neighbours (u_j - u_i)/h^2, with the neighbour replaced by a wall at the part theta
    of h; minus the difference of the pressures of both cells; plus the driving force. Each cell: the sum of
    the flow through its faces is 0.
    """

    def distance(component, place):
        points = (np.array(place) + 0.5) * spacing
        points[component] -= 0.5 * spacing[component]
        images = [points + np.array(s) for s in np.ndindex(3, 3, 3)]
        return min(float(one.distances(p - 1)) for one in solids for p in images)

    depth = {(a, *c): distance(a, c) for a in range(3) for c in np.ndindex(*cells)}
    fluid = {face: k for k, face in enumerate(f for f, d in depth.items() if d > 0.02 * min(spacing))}
    n = len(fluid)
    pressure = {c: n + k for k, c in enumerate(np.ndindex(*cells))}

    def beside(c, axis, step):
        return tuple((c[b] + step * (b == axis)) % cells[b] for b in range(3))

    rows, right = [], np.zeros(n + len(pressure))
    for (a, *place), i in fluid.items():
        c = tuple(place)
        right[i] = -fall[a]
        for b in range(3):
            for step in (-1, 1):
                j = (a, *beside(c, b, step))
                if j in fluid:
                    rows += [(i, fluid[j], 1 / spacing[b] ** 2), (i, i, -1 / spacing[b] ** 2)]
                else:
                    there = min(depth[j], 0.0)
                    theta = depth[a, *c] / (depth[a, *c] - there)
                    rows.append((i, i, -1 / (theta * spacing[b] ** 2)))
        rows += [(i, pressure[c], -1 / spacing[a]), (i, pressure[beside(c, a, -1)], 1 / spacing[a])]
    for c, k in pressure.items():
        faces = [
            ((a, *beside(c, a, step)), (1 if step else -1) / spacing[a]) for a in range(3) for step in (0, 1)
        ]
        rows += [(k, fluid[f], value) for f, value in faces if f in fluid]
        if not any(f in fluid for f, _ in faces) or k == n + len(pressure) // 2:
            # The pressure in bodies, and its mean, mean nothing.
            rows = [row for row in rows if row[0] != k] + [(k, k, 1.0)]
    i, j, values = zip(*rows, strict=True)
    matrix = coo_array((values, (i, j)), shape=(len(right),) * 2).tocsc()
    found = spsolve(matrix, right)
    velocity = np.zeros((3, *cells))
    for face, k in fluid.items():
        velocity[face] = found[k]
    return velocity


def test_a_direct_solution_of_the_same_equations_agrees():
    cells, fall = (8, 9, 10), (0.6, -0.2, 1.0)
    # The corner of the box at which the direct solution fixes the pressure lies in the fluid.
    found = flow(FIBRES, cells, fall, tolerance=TIGHT)
    expected = direct(FIBRES, cells, fall, 1 / np.array(cells))
    scale = np.linalg.norm(found.mean_velocity)
    np.testing.assert_allclose(found.velocity, expected, atol=1e-5 * scale)
    np.testing.assert_allclose(found.mean_velocity, expected.mean(axis=(1, 2, 3)), rtol=3e-7)


def test_bodies_may_overlap_touch_and_fill_the_box_many_times():
    """A long fibre with many periodic images is the same as its pieces. Its images are 0.2 apart."""
    whole = [SolidCylinder((0.5, 0.5, 0.5), (0.0, 0.6, 0.8), 0.07, 6.0)]
    pieces = [
        SolidCylinder((0.5, 0.5 + 0.6 * s, 0.5 + 0.8 * s), (0.0, 0.6, 0.8), 0.07, 1.2)
        for s in np.arange(-2, 3)
    ]
    k = [
        flow(solids, (32, 32, 32), (1.0, 0.0, 0.0), tolerance=1e-6).permeability for solids in (whole, pieces)
    ]
    assert k[1] == pytest.approx(k[0], rel=1e-9)


def test_progress_grows_to_one():
    told = []
    flow(FIBRES, (16, 16, 16), progress=told.append)
    assert len(told) > 5
    assert 0 <= min(told) <= max(told) == told[-1] == 1


def test_threads_do_not_change_a_bit(monkeypatch):
    found = []
    for threads in (1, 2, 3):
        monkeypatch.setattr("tisim.sources.pore_flow.stokes_flow.cores", lambda threads=threads: threads)
        found.append(flow(FIBRES, (20, 18, 22)).velocity)
    assert (found[0] == found[1]).all()
    assert (found[0] == found[2]).all()


WALL = SolidCylinder((0.5, 0.5, 0.5), (0.0, 0.0, 1.0), 2.0, 0.3)
WRONG = {
    "pores must be open along the pressure gradient at 8 x 8 x 8 cells, so that a fluid can flow through;"
    " received bodies and walls that block it": {"solids": [WALL]},
    "solids must be bodies, or a column with walls; received none": {"solids": []},
    "cells must be fine enough for 2 of them across the thinnest body, of 0.1 m; received (8, 8, 8)": {
        "solids": [SolidSphere((0, 0, 0), 0.05)]
    },
    "cells must be fine enough for 2 of them along axis 0 across a body of 0.3 m; received (4, 8, 8)": {
        "solids": [SolidSphere((0, 0, 0), 0.15)],
        "cells": (4, 8, 8),
    },
    "cells must be such that faces of the grid lie in the bodies; received (1, 8, 8)": {
        "solids": [SolidSphere((0.25, 0, 0), 0.2)],
        "cells": (1, 8, 8),
    },
    "solids must be at most 10 m long along axis 0, 10 periods of the box; received 12.0": {
        "solids": [SolidSphere((0, 0, 0), 6.0)]
    },
    "cells must be three whole numbers, at least 1; received (8, 8)": {"cells": (8, 8)},
    "high must be above low in every component; received [1.0, 0.0, 1.0]": {"high": (1, 0, 1)},
    "viscosity must be above 0 Pa s; received 0": {"viscosity": 0},
    "tolerance must be from 1e-07 to 0.1; received 1e-12": {"tolerance": 1e-12},
    "pressure_gradient must be finite and not 0; received (0.0, 0.0, 0.0)": {"pressure_gradient": (0, 0, 0)},
    "pressure_gradient must be along the duct, axis 2; received (1.0, 0.0, 1.0)": {
        "pressure_gradient": (1, 0, 1),
        "column": "duct",
    },
    "high must be as far from low along both axes across the tube; received [1.0, 2.0, 1.0]": {
        "high": (1, 2, 1),
        "column": "tube",
    },
    "column must be 'none', 'duct' or 'tube'; received 'pipe'": {"column": "pipe"},
}


@pytest.mark.parametrize("message", WRONG)
def test_input_without_meaning_is_refused(message):
    right = {
        "solids": FIBRES, "low": (0, 0, 0), "high": (1, 1, 1), "cells": (8, 8, 8),
        "pressure_gradient": (0, 0, -1), "viscosity": 1.0,
    }  # fmt: skip
    with pytest.raises(InputError) as fault:
        stokes_flow(**{**right, **WRONG[message]})
    assert str(fault.value) == message


def test_a_wall_blocks_the_flow_across_it_only():
    assert flow([WALL], (8, 8, 8), (1.0, 0.0, 0.0)).permeability > 0
    # A closed cavity beside an open channel does not matter.
    with pytest.raises(InputError, match="open along the pressure gradient"):
        flow([WALL], (8, 8, 8), (0.0, 0.0, 1.0))


def test_a_staircase_of_pores_is_open_along_the_sum_of_its_periods():
    """Two crossed families of tilted walls leave channels along (1, 1, 0) and z only."""
    n = (np.array([1.0, -1.0, 0.0]) / np.sqrt(2)).tolist()
    wall = SolidCylinder((0.5, 0.5, 0.5), tuple(n), 5.0, 0.25)
    along = flow([wall], (16, 16, 4), (1.0, 1.0, 0.0))
    assert along.mean_velocity[0] == pytest.approx(along.mean_velocity[1], rel=1e-3)
    with pytest.raises(InputError, match="open along the pressure gradient"):
        flow([wall], (16, 16, 4), (1.0, -1.0, 0.0))
