"""Studies of the case packing: their packings, their tables, and the numbers of B16 beside them."""

from dataclasses import replace

import numpy as np
import pytest

from tisim.analysis import Mean
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.cases.packing.comparisons import compared, confined, scaled, shortest_fraction
from tisim.cases.packing.curves import of_cylinders, of_rods, of_superballs, of_wedges
from tisim.cases.packing.figures import compared_bodies, profile, wall_profiles
from tisim.cases.packing.measures import contact_counts
from tisim.cases.packing.scene import rod
from tisim.cases.packing.snapshots import direction_shares, in_cylinders, in_wedges, wedge_directions
from tisim.cases.packing.studies import PackedPlan, measured_packings, packed, plans, shortest
from tisim.cases.packing.study_table import STUDIES, PackedRow, means, read, summary, table
from tisim.geometry import WedgeContainer
from tisim.shapes import SphereShape

SETTINGS = {"attempts": 40, "number": 40, "step": 3.0}
"""A packing of a second."""


def row(study, shape, seed=0, method="original", **measures):
    """A line of a study that has not been packed."""
    given = {"width": np.nan, "angle": np.nan, "inertia": 1.0, "number": 200, "step": 1.0, "limit": 2000}
    given |= {"halvings": 4, "tolerance": 1e-4, "attempts": 10_000, "fraction": 0.6, "contacts": 6.0}
    given |= {"touching": 6.2, "held": 6.0, "nematic": 0.1, "cubatic": 0.1, "aligned": 0.5}
    given |= {"with_any": 0.6}
    return PackedRow(study=study, method=method, shape=shape, seed=seed, **{**given, **measures})


FREE = [
    row("aspect ratio", shape, seed, fraction=0.6 + 0.01 * (shape == 2.0) + 0.001 * seed, contacts=6.0)
    for shape in (1.0, 2.0, 3.0)
    for seed in (-1, 0, 1)
]
"""Rods in a periodic box, with a packing fraction of 0.6, of 0.61 for Lambda = 2."""


def line(found, subject):
    """The number here on the line of a subject."""
    (one,) = (one.here for one in found if one.subject == subject)
    return one


@pytest.mark.slow
def test_rows_of_a_study():
    """A table is read as it was written; a container is filled to the volume between its walls."""
    free, narrow = plans("aspect ratio")[0], PackedPlan("cylinder", 1.0, width=1.1)
    rows = [*packed([free], "small", 2, **SETTINGS), *packed([narrow], "small", 1, **SETTINGS)]
    assert table(read(table(rows))) == table(rows)
    assert [one.seed for one in rows] == [0, 1, 0]
    # Spheres in a file, at most in contact: pi/6 D^3 in pi/4 D_cyl^2 D.
    assert 0.1 < rows[2].fraction < 1.05 * 2 / 3 / 1.1**2
    assert 0.3 < rows[0].fraction < 0.66
    (mean,) = means(rows[:2], ("shape",), "fraction").values()
    assert mean.value == pytest.approx((rows[0].fraction + rows[1].fraction) / 2)
    # What a table has is not packed again, also after the table has been read.
    made = {one.key() for one in read(table(rows))}
    others = measured_packings([free, narrow], "small", 2, made=made, **SETTINGS)
    assert [(one.study, one.seed) for one, _ in others] == [("cylinder", 1)]


def test_the_effort_of_a_plan_is_in_proportion_to_the_size():
    """B16 has 500 bodies and 100,000 attempts, and 750 superballs."""
    balls, xi = plans("superballs")[0], plans("moment of inertia")[0]
    found = [
        [one.options(size)[name] for size in ("small", "default", "paper")]
        for one in (balls, xi)
        for name in ("number", "attempts")
    ]
    assert found == [[30, 100, 750], [50, 500, 25_000], [60, 200, 500], [100, 1000, 50_000]]
    starts = [PackedPlan("aspect ratio", one).options("small")["start"] for one in (1.0, 5.0, 10.0)]
    assert starts == [0.2, 0.2, 0.1]
    assert PackedPlan("aspect ratio", 10.0).options("default")["start"] == 0.1
    long = plans("long rods")[0]
    assert long.options("default")["number"] == long.least_number(1) == long.options("small")["number"]


def test_plans_are_packings_of_their_own():
    for study in STUDIES:
        keys = [tuple(map(str, vars(plan).values())) for plan in plans(study)]
        assert len(set(keys)) == len(keys) > 1


def test_a_box_is_twice_as_wide_as_a_body_is_long():
    """At the largest density that a study expects, which the step of the volume follows."""
    plan = PackedPlan("aspect ratio", 10.0)
    options = plan.options("default")
    assert options["number"] > 700
    side = (options["number"] * rod(10.0).volume() / 0.5) ** (1 / 3)
    assert side > 2 * 10.0
    assert options["step"] == pytest.approx(options["number"] / 200)


def test_one_row_of_rods_in_the_shortest_wedge():
    """(2.13) is the volume of a rod in a slice of the wedge of width D."""
    wedge = WedgeContainer(length=shortest(3.0, 18.0), angle=np.radians(18.0))
    slice_of_wedge = wedge.volume_in(np.ones(3), 1.0)
    assert shortest_fraction(3.0, 18.0) == pytest.approx(rod(3.0).volume() / slice_of_wedge)


def test_scaled_means():
    half = scaled(Mean(4.0, 0.2), Mean(6.0, 0.0))
    assert (half.value, half.half) == (pytest.approx(0.5), pytest.approx(0.05))
    least = scaled(Mean(2.0, 0.2), Mean(6.0, 0.4))
    assert (least.value, least.half) == (0.0, pytest.approx(0.05))


def test_cylinders_beside_b16():
    """A packing fraction that is linear in 1/D_cyl ends at its periodic value."""
    rows = [
        row(
            "cylinder",
            2.0,
            seed,
            width=width,
            fraction=0.61 - 0.1 / width + 1e-4 * seed,
            nematic=2.9 / width**2,
        )
        for width in (1.9, 2.3, 3.5, 4.5, 6.0, 8.0)
        for seed in (-1, 0, 1)
    ]
    found = compared("cylinder", rows, FREE)
    assert line(found, "phi at 1/D_cyl = 0, Lambda = 2").startswith("0.61")
    assert line(found, "least phi*, Lambda = 2").endswith("at 1.9 D")
    assert line(found, "least phi* above 2.2 D, Lambda = 2").endswith("at 2.3 D")
    assert line(found, "S for D_cyl >= 1.5 Lambda, Lambda = 2") == "0.05 to 0.24, mean 0.13"
    assert of_cylinders(rows, FREE).axes[3].lines[0].get_xdata()[-1] == 0


def test_efforts_in_a_wedge_are_compared_by_attempts_and_by_length():
    few, many, long = plans("wedge effort")
    assert (few.limit, many.limit, long.width) == (None, 20_000, pytest.approx(2 * few.width))
    rows = [
        row("wedge effort", 3.0, seed, width=one.width, angle=45.0, limit=one.limit or 2000, aligned=aligned)
        for one, aligned in ((few, 0.7), (many, 0.8), (long, 0.75))
        for seed in (0, 1)
    ]
    found = {one.subject: one.here for one in compared("wedge effort", rows)}
    lines = ("3 l_min, 200 rods, 2000", "3 l_min, 200 rods, 20000", "6 l_min, 200 rods, 2000")
    assert list(found) == [f"Lambda 3, 45 degrees, {one} attempts" for one in lines]
    assert [one.split()[1] for one in found.values()] == ["0.7", "0.8", "0.75"]
    assert not any("phi*" in one for one in found.values())
    # Beside rods in a periodic box: halfway from one row of rods to their density, and at their contacts.
    half = (shortest_fraction(3.0, 45.0) + 0.6) / 2
    rows = [replace(one, fraction=half) for one in rows]
    for one in compared("wedge effort", rows, FREE):
        assert one.here.split("phi* ")[1].startswith("0.500")
        assert one.here.split("<C>* ")[1].startswith("1")


def test_wedges_beside_b16():
    """phi* is 0 for one row of rods and 1 at the periodic value."""
    least = shortest_fraction(3.0, 9.0)
    rows = [
        row(
            "wedge",
            3.0,
            seed,
            width=factor * shortest(3.0, 9.0),
            angle=9.0,
            fraction=value + 1e-6 * seed,
            aligned=0.9,
        )
        for factor, value in ((1.0, least), (3.0, 0.6))
        for seed in (-1, 0, 1)
    ]
    found = compared("wedge", rows, FREE)
    assert line(found, "phi*, 9 degrees, Lambda = 3").startswith("1.0")
    assert line(found, "f_align, longest wedges, Lambda = 3").startswith("0.9")
    (first,) = of_wedges(rows, FREE).axes[0].lines[:1]
    assert [float(one) for one in first.get_xdata()] == pytest.approx([1, 3])
    assert [float(one) for one in first.get_ydata()] == pytest.approx([0, 1], abs=1e-6)


@pytest.mark.slow
def test_rods_and_superballs_beside_b16():
    rods = [*FREE, *(row("aspect ratio", 3.0, seed, "revised", touching=6.7) for seed in range(3))]
    found = compared("aspect ratio", rods)
    assert line(found, "densest aspect ratio").startswith("2, 0.610")
    assert line(found, "contact number up to 1e-4 D, revised minus original, Lambda = 3").startswith("0.5")
    assert "0.1" in line(found, "largest S")
    assert of_rods(rods).axes[1].get_xscale() == "log"
    balls = [
        row(
            "superballs",
            shape,
            seed,
            "revised",
            fraction=0.6 + 0.01 * seed - 0.02 * (shape - 3) ** 2,
            contacts=8 - shape,
        )
        for shape in (2.0, 3.0, 5.0)
        for seed in range(3)
    ]
    found = compared("superballs", balls)
    assert line(found, "densest exponent").startswith("3, 0.61")
    assert line(found, "contact number up to 1e-4 D, exponent 5").startswith("6.2")
    assert len(of_superballs(balls).axes) == 3
    # Loose packings of few attempts are inside the axes, too.
    assert of_superballs([replace(one, fraction=0.4) for one in balls]).axes[0].get_ylim()[0] < 0.4


def test_the_summary_has_the_means_of_each_packing_and_the_settings_that_vary():
    rows = [
        row("wedge", 3.0, seed, width=width, angle=45.0, aligned=0.7 + 0.1 * seed, contacts=width)
        for width in (4.0, 2.0) for seed in (1, 0)
    ]  # fmt: skip
    head, first, second = summary(rows)
    measures = ["fraction", "contacts", "touching", "held", "nematic", "cubatic", "aligned", "with_any"]
    assert head == ["width", "starts", *measures, "attempts"]
    assert first[:2] == ["2", "2"]
    assert (first[3], second[3]) == ("2 ± 0", "4 ± 0")
    assert first[8].startswith("0.75 ± 0.6")
    # One start has no interval; what does not apply is left out.
    head, only = summary([row("aspect ratio", 1.5, aligned=np.nan, with_any=np.nan)])
    assert head == ["starts", *measures[:-2], "attempts"]
    assert only[:2] == ["1", "0.6 (one start)"]
    # A mean over no bodies is not a number.
    assert summary([row("aspect ratio", 1.0, held=np.nan), row("aspect ratio", 1.0, 1)])[1][4] == "-"


def test_packings_in_cylinders_and_wedges_relative_to_periodic_ones():
    """By hand: 0.3/0.6, (3 - 2)/(6 - 2), and the range from one row of rods."""
    free = [row("aspect ratio", 3.0, seed) for seed in (0, 1)]
    tube = [row("cylinder", 3.0, seed, width=2.0, fraction=0.3, contacts=3.0) for seed in (0, 1)]
    head, first = confined(tube, free)
    assert head == ["Lambda", "width, D", "angle", "phi*", "<C>*"]
    assert first == ["3", "2", "-", "0.5 ± 0", "0.25 ± 0"]
    low = shortest_fraction(3.0, 9.0)
    wedge = [row("wedge", 3.0, seed, width=25.0, angle=9.0, fraction=0.6 - seed * 0.1) for seed in (0, 1)]
    _, only = confined(wedge, free)
    assert only[:3] == ["3", "25", "9"]
    assert float(only[3].split()[0]) == pytest.approx((0.55 - low) / (0.6 - low), abs=0.05)
    assert "±" in only[3]


def test_shares_of_directions_in_a_wedge():
    """Of eight rods three lie along the bottom, two along the back and one along the edge of the wedge."""
    along = np.deg2rad([1.0, 5.0, -12.0, 85.0, -88.0, 40.0, 60.0, 50.0])
    cosine = np.array([0.1, 0.2, 0.3, 0.1, 0.2, 0.95, 0.3, 0.4])
    sine = np.sqrt(1 - cosine**2)
    axes = np.stack([sine * np.cos(along), sine * np.sin(along), cosine], axis=1)
    # The turn that takes z to the axis, about the bisector of both.
    half = axes + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=1)[:, None]
    turns = np.concatenate([np.zeros((8, 1)), half], axis=1)
    bodies = PackedBodies.of(rod(3.0), np.zeros((8, 3)), np.zeros(3), np.ones(3), turns)
    wedge = row("wedge", 3.0, width=2 * shortest(3.0, 9.0), angle=9.0)
    (found,) = direction_shares([(wedge, bodies), (replace(wedge, angle=45.0), bodies)])
    assert found == (
        "directions, 2 $l_{w,min}$: bottom or slope 0.375 (0.150), back 0.250 (0.150), edge 0.125 (0.125)"
    )


def test_xi_beside_b16():
    """The loss of density between 0.1 and 10 times the moment of inertia."""
    rows = [
        row(
            "moment of inertia",
            1.5,
            seed,
            inertia=xi,
            fraction=0.6 - 0.01 * abs(np.log10(xi) + 1) + 1e-5 * seed,
        )
        for xi in (0.01, 0.1, 1.0, 10.0)
        for seed in range(3)
    ]
    here = line(compared("moment of inertia", rows), "phi for xi = 0.1 to 10 I, Lambda = 1.5")
    assert here == "3.3 % below the largest, at xi = 0.1 I"
    few, many = plans("moment of inertia"), plans("inertia effort")
    assert {one.limit for one in many} == {10_000}
    assert [replace(one, study="moment of inertia", limit=1000) for one in many] == few
    assert compared("inertia effort", rows) == compared("moment of inertia", rows)


def test_contacts_of_a_row_of_spheres():
    places = [(float(k), 0.5, 0.5) for k in range(4)]
    bodies = PackedBodies.of(SphereShape(diameter=1.0), places, (0, 0, 0), (9, 9, 9))
    assert contact_counts(bodies).tolist() == [1, 2, 2, 1]


def test_neighbours_of_spheres_rods_and_superballs_are_compared_if_all_are_there():
    balls = [(row("superballs", shape), f"exponent {shape:g}") for shape in (2.0, 4.0)]
    rods = [(row("aspect ratio", shape, seed), (shape, seed)) for shape in (1.0, 2.0, 3.0) for seed in (0, 1)]
    assert compared_bodies({"aspect ratio": rods, "superballs": balls}) == {
        "spheres": (1.0, 0),
        "rods, L/D = 2": (3.0, 0),
        "superballs, exponent 4": "exponent 4",
    }
    assert compared_bodies({"aspect ratio": rods}) == {}


def test_layers_at_the_wall_of_a_cylinder():
    """Spheres of diameter 2 in a row on the axis of a cylinder four times as wide, whose box has stayed
    behind: none within 1.5 D of the wall, and the row beyond fills what spheres in a tube of their width do;
    titles have the shape, and the widest cylinder is drawn."""
    unit, number = 2.0, 9
    places = np.column_stack([np.full((number, 2), 0.5), unit * (0.5 + np.arange(number))])
    axis = (False, False, True)
    bodies = PackedBodies.of(
        SphereShape(diameter=unit), places, (0, 0, 0), (1, 1, unit * number), periodic=axis
    )
    wide, narrow = (row("cylinder", 1.0, width=width) for width in (4.0, 2.0))
    layers = profile(wide, bodies)
    assert layers.edges[-1] == 4.0
    middle = 0.5 * (layers.edges[1:] + layers.edges[:-1])
    assert (layers.fraction[middle < 1.5] == 0).all()
    # The part of a line at a distance h from the axis, of radius 1/2 in D, that is within spheres.
    within = (middle > 1.5) & (middle < 2)
    expected = np.sqrt(1 - 4 * (2 - middle[within]) ** 2)
    np.testing.assert_allclose(layers.fraction[within], expected, atol=0.06)
    shown = wall_profiles([(wide, bodies), (replace(wide, seed=1), bodies), (narrow, bodies)])
    assert list(shown) == ["spheres in a cylinder of 4 D"]
    np.testing.assert_allclose(shown["spheres in a cylinder of 4 D"].fraction, layers.fraction)
    assert wall_profiles([]) == {}


@pytest.mark.slow
def test_pictures_of_packings():
    """Packings of the first seed are drawn, of a cylinder one segment; rods in a wedge by direction."""
    plans_of = [
        PackedPlan("cylinder", 1.0, width=2.3),
        PackedPlan("wedge", 3.0, width=2 * shortest(3.0, 9.0), angle=9.0),
    ]
    made = [
        (one, packing.bodies)
        for one, packing in measured_packings(plans_of, "small", 1, number=30, attempts=20, step=4.0)
    ]
    figure = in_cylinders(made[:1])
    assert "D_{cyl}" in figure.axes[0].get_title()
    assert figure.axes[0].images
    assert "9°" in in_wedges(made[1:]).axes[0].get_title()
    density = wedge_directions(made[1:]).axes[0].collections[0].get_array()
    # Most rods lie along the bottom or the slope, within the first two bins of the azimuth.
    assert density[:, :3].mean() > 2 * density[:, 3:].mean()


def test_packings_are_sorted_by_plan_and_seed():
    rows = [
        row("cylinder", shape, seed, width=width)
        for shape in (3.0, 1.0)
        for width in (4.5, 2.3)
        for seed in (1, 0)
    ]
    places = [(one.shape, one.width, one.seed) for one in sorted(rows, key=PackedRow.place)]
    assert places == sorted(places)
