"""Starts of bodies with shapes: deep overlaps give a warning, rightly packed bodies give none."""

import re
import resource

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from tests.effects.constraint.shapes import BALL, BRICK, DENSITY, EGG, ROD, D, moving
from tests.engine.test_crowding import found, refused
from tests.shapes.pairs import Bodies, searched_gap
from tisim import Box, Material
from tisim.effects import Granular, HertzMaterial, Oscillation, Walls
from tisim.engine import crowd, shape_overlaps
from tisim.geometry import Plane
from tisim.shapes import SpherocylinderShape

LAW = Granular(normal=HertzMaterial())
MATERIALS = {"glass": Material(young=1e7, poisson=0.3)}
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
ALONG_X = Rotation.from_rotvec([0, np.pi / 2, 0]).as_quat(scalar_first=True)
SIDE = 8 * D
BOX = Box(low=(0, 0, 0), high=(SIDE,) * 3)


def start(body, place, *others, **more):
    """Bodies at rest under a granular law."""
    return moving(body, place, (LAW, *others), materials=MATERIALS, **more)


def rod_gaps(shapes, kinds, sizes, turns, pairs, separation):
    """Gaps (m) of rods by bounded least squares."""
    half = np.array([one.length / 2 for one in shapes])[kinds] * sizes
    radius = np.array([one.radius for one in shapes])[kinds] * sizes
    ends = turns.apply([0, 0, 1]) * half[:, None]
    result = []
    for (i, j), apart in zip(pairs, separation, strict=True):
        sides = np.stack([ends[i], -ends[j]], axis=1)
        best = lsq_linear(sides, apart, (-1, 1), method="bvls", tol=1e-15)
        result.append(np.linalg.norm(apart - sides @ best.x) - radius[i] - radius[j])
    return np.array(result)


def superquadric_gaps(shapes, kinds, sizes, turns, pairs, separation):
    """Gaps (m) of superquadrics by a search over directions."""
    axes = np.array([one.semi_axes for one in shapes])[kinds] * sizes[:, None] / D
    exponents = np.array([one.exponents for one in shapes])[kinds]
    i, j = (Bodies(turns[k], axes[k], exponents[k]) for k in pairs.T)
    return D * searched_gap(np.random.default_rng(0), separation / D, i, j, directions=500)


def twin(one, gaps):
    """The deepest overlap over the smaller half thickness, its pair, and the number of deep overlaps, from
    all pairs of minimum images."""
    given, shapes = one.start(), one.effects[0].shapes()
    kinds = given["shape"].astype(int)
    sizes = given["radius"] / np.array([shape.bounding_radius() for shape in shapes])[kinds]
    thickness = np.array([shape.half_extents().min() for shape in shapes])[kinds] * sizes
    pairs = np.array(np.triu_indices(len(kinds), 1)).T
    separation = given["position"][pairs[:, 1]] - given["position"][pairs[:, 0]]
    separation -= SIDE * np.rint(separation / SIDE)
    # Deep overlaps need near centres.
    near = np.linalg.norm(separation, axis=1) < given["radius"][pairs].sum(axis=1)
    pairs, separation = pairs[near], separation[near]
    turns = Rotation.from_quat(given["orientation"], scalar_first=True)
    parts = -gaps(shapes, kinds, sizes, turns, pairs, separation) / thickness[pairs].min(axis=1)
    return parts.max(), pairs[parts.argmax()].tolist(), int((parts >= 0.5).sum())


@pytest.mark.parametrize(
    ("shapes", "gaps"),
    [
        pytest.param((ROD, BALL), rod_gaps, id="rods"),
        pytest.param((BRICK, EGG), superquadric_gaps, id="bricks", marks=pytest.mark.slow),
    ],
)
def test_the_deepest_overlap_is_told(rng, shapes, gaps):
    """Of random bodies of two shapes and of unlike sizes in a periodic box, as by a search over all pairs."""
    number = 60
    sizes = rng.choice([0.2, 1.0], number)
    turns = Rotation.random(number, rng=rng).as_quat(scalar_first=True)
    made = start(
        shapes,
        rng.uniform(0, SIDE, (number, 3)),
        domain=BOX,
        shape=rng.integers(0, 2, number),
        size=sizes,
        orientation=turns,
    )
    part, pair, deep = twin(made, gaps)
    words = re.fullmatch(
        r"particles (\d+) and (\d+) overlap by \S+ m, (\S+) of the smaller half thickness, at \(.*\) m, "
        r"at the start; (\d+) more overlap by 0.5 of a half thickness or more",
        found(made),
    )
    assert words, found(made)
    assert deep > 3
    assert [int(words[1]), int(words[2])] == pair
    assert float(words[3]) == pytest.approx(part, rel=2e-3)
    assert int(words[4]) == deep - 1


def test_needles_and_bricks_side_by_side_give_no_warning():
    """Their bounding spheres overlap deeply; also with shallow overlaps, and across a periodic face."""
    needle = SpherocylinderShape(length=20 * D, diameter=D)
    row = np.column_stack([0.8 * D * np.arange(8), np.zeros(8), np.zeros(8)])
    assert found(start(needle, row, orientation=UPRIGHT)) == ""
    assert found(start(needle, 0.7 * row, orientation=UPRIGHT)).startswith("particles ")
    wall = Walls(planes=(Plane(point=(0, 0, -10.4 * D)), Plane(point=(-0.5 * D, 0, 0), normal=(1, 0, 0))))
    assert found(start(needle, row, wall, orientation=UPRIGHT)) == ""
    sites = np.stack(np.meshgrid(*map(np.arange, (4, 4, 4))), axis=-1).reshape(-1, 3)
    a = np.array(BRICK.semi_axes)
    for share, told in ((1.0, False), (0.8, False), (0.7, True)):
        # 0.7 of the distance leaves an overlap of 0.6 of the half thickness along the shortest axis.
        apart = 2 * a * [1, share, 1]
        box = Box(low=(0, 0, 0), high=tuple(4 * apart))
        packed = start(BRICK, apart * (sites + 0.1), orientation=UPRIGHT, domain=box)
        words = found(packed)
        assert bool(words) == told, (share, words)
    assert "overlap by 0.00042 m, 0.6 of the smaller half thickness" in words


def test_bodies_in_a_plane_give_a_warning():
    """A rod stands or lies, a brick lies flat; fixed bodies may lie in walls; a moving wall counts at its
    initial position."""
    floor = Walls(planes=(Plane(),))
    for turn, reach in ((UPRIGHT, 2.5 * D), (ALONG_X, 0.5 * D)):
        assert found(start(ROD, [[0, 0, reach - 0.24 * D]], floor, orientation=turn)) == ""
        words = found(start(ROD, [[0, 0, reach - 0.3 * D]], floor, orientation=turn))
        assert words.startswith("particle 0 lies in effects.walls by 0.0003 m, 0.6 of its half thickness, ")
    words = found(start(BRICK, [[0, 0, 3], [1, 0, 1.5e-3]], floor, orientation=UPRIGHT))
    assert words.startswith("particle 1 lies in effects.walls by 0.0005 m, 0.714 of its half thickness, at (")
    words = found(start(BRICK, [[0, 0, -D], [1, 0, -D]], floor, orientation=UPRIGHT))
    assert words.startswith("particle 0 lies behind effects.walls by 0.003 m, 4.29 of its half thickness")
    assert words.endswith("; 1 more overlap by 0.5 of a half thickness or more")
    fixed = {"fixed": np.array([1.0])}
    assert found(start(BRICK, [[0, 0, -D]], floor, orientation=UPRIGHT, quantities=fixed)) == ""
    up = Walls(planes=(Plane(),), motion=Oscillation(amplitude=(0, 0, D), frequency=50.0, phase=np.pi / 2))
    assert found(start(BRICK, [[0, 0, 2.5 * D]], up, orientation=UPRIGHT)).startswith("particle 0 lies in")
    tilted = Plane(normal=(3.0, 0.0, 4.0))
    # The lowest point of an ellipsoid along n is sqrt(sum (a_k n_k)^2) below its centre.
    depth = np.hypot(0.6 * 1e-3, 0.8 * 2e-3)
    for shift, told in ((0.3e-3, False), (0.4e-3, True)):
        place = np.array([[0.6, 0, 0.8]]) * (depth - shift)
        words = found(start(EGG, place, Walls(planes=(tilted,)), orientation=UPRIGHT))
        assert bool(words) == told
    assert "by 0.0004 m, 0.571 of its half thickness" in words


def test_fixed_bodies_may_overlap():
    """Rows of fixed rods replace a wall; a free body in them gives a warning."""
    row = np.column_stack([0.3 * D * np.arange(5), np.zeros(5), np.zeros(5)])
    fixed = np.ones(5)
    assert found(start(ROD, row, orientation=UPRIGHT, quantities={"fixed": fixed})) == ""
    fixed[2] = 0
    words = found(start(ROD, row, orientation=UPRIGHT, quantities={"fixed": fixed}))
    # Its neighbours at 0.3 D overlap by 1.4 radii, the next ones at 0.6 D by 0.8 radii.
    assert "1.4 of the smaller half thickness" in words
    assert words.endswith("; 3 more overlap by 0.5 of a half thickness or more")


def test_centres_at_one_place_are_refused():
    """As for spheres."""
    rule = "particles.position must be a different place for each particle, as effects.granular holds them"
    assert refused(start(BRICK, np.zeros((2, 3)))).startswith(rule)


@pytest.mark.parametrize("shape", [ROD, BRICK], ids=["rods", "bricks"])
def test_crowds_take_bounded_time(rng, shape, monkeypatch):
    """Above a number of pairs the nearest ones are examined, and a crowd at one place is told by its
    number."""
    number = 400
    places = rng.uniform(0, SIDE, (number, 3))
    dense = start(shape, places, domain=BOX, size=0.5)
    whole = found(dense)
    # Pairs whose bounding spheres overlap are too many, but not those of smaller spheres.
    monkeypatch.setattr(shape_overlaps, "MOST_PAIRS", 5000)
    monkeypatch.setattr(shape_overlaps, "MOST_GAPS", 100)
    sought = crowd.Crowd.near_pairs
    reaches = []
    monkeypatch.setattr(
        crowd.Crowd, "near_pairs", lambda self, reach, most: reaches.append(1) or sought(self, reach, most)
    )
    some = found(dense)
    assert len(reaches) > 1
    assert some.startswith("particles ")
    others = [int(re.search(r"; (\d+) more", words)[1]) for words in (whole, some)]
    assert 100 <= others[1] < others[0]
    together = start(shape, 1e-3 * places, domain=BOX)
    assert re.match(r"about \d+ pairs of particles overlap, at the start", found(together))


@pytest.mark.slow
def test_a_large_packing_is_checked_in_seconds():
    """100,000 bricks on a grid, whose bounding spheres overlap."""
    sites = np.stack(np.meshgrid(np.arange(50), np.arange(50), np.arange(40)), axis=-1).reshape(-1, 3)
    a = np.array(BRICK.semi_axes)
    packed = start(BRICK, 1.96 * a * sites, orientation=UPRIGHT, density=DENSITY)
    before = resource.getrusage(resource.RUSAGE_SELF)
    assert found(packed) == ""
    after = resource.getrusage(resource.RUSAGE_SELF)
    assert after.ru_utime - before.ru_utime < 30
