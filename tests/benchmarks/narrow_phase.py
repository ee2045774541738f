"""Time of the shortest distance of a pair, beside coal on the same pairs in the same run: ns of CPU a pair.

    python tests/benchmarks/narrow_phase.py [--pairs 4096] [--turns 7] [--precision f64] [--arithmetic strict]

Both give gap, normal and points of contact, on one thread. Turns alternate; the table has medians, and the
least and largest in brackets. Random orientations, separations in random directions, gaps from -0.02 to 0.3
of the radius of a sphere of equal volume: the neighbours of a dense packing. coal is called from Python: its
column "per call" is the time of a pair of spheres, of which its own part is some ns, and is included in its
other times. coal does not know superquadrics.

``far`` ends pairs once a plane proves that they are more than 0.02 radii apart. coal: pip install ".[bench]"
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import coal
import numpy as np
from scipy.spatial.transform import Rotation

from tests.benchmarks.turns import rest, spread
from tisim.backend import runtime
from tisim.backend.processor import processor
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.vectors import rotation_matrix
from tisim.pairs.listed_pairs import LANES
from tisim.shapes import EllipsoidShape, ParticleShape, SphereShape, SpherocylinderShape, SuperquadricShape
from tisim.shapes.rod_pairs import closest_rods
from tisim.shapes.superquadric_pairs import closest_superquadrics
from tisim.shapes.superquadric_points import ELLIPSOIDS, SUPERQUADRICS

CASES: dict[str, ParticleShape] = {
    "spheres": SphereShape(diameter=1.0),
    "rods, aspect ratio 5": SpherocylinderShape(length=4.0, diameter=1.0),
    "rods, aspect ratio 100": SpherocylinderShape(length=99.0, diameter=1.0),
    "ellipsoids 1:1:2": EllipsoidShape(semi_axes=(0.5, 0.5, 1.0)),
    "ellipsoids 1:2:5": EllipsoidShape(semi_axes=(0.5, 1.0, 2.5)),
    "superballs, exponent 3": SuperquadricShape(semi_axes=(0.5,) * 3, exponents=(3.0,) * 3),
    "superballs, exponent 5": SuperquadricShape(semi_axes=(0.5,) * 3, exponents=(5.0,) * 3),
    "superballs, exponent 20": SuperquadricShape(semi_axes=(0.5,) * 3, exponents=(20.0,) * 3),
    "superquadrics 1:2:5, exponents 2, 4, 8": SuperquadricShape(
        semi_axes=(0.5, 1.0, 2.5), exponents=(2.0, 4.0, 8.0)
    ),
}
VALUES = 10
"""Gap, normal and two points."""
NEAR, FAR, LIMIT = -0.02, 0.3, 0.02
"""Gaps of the pairs, and the one beyond which pairs do not interact, in radii."""


class Pairs:
    """Pairs of one shape, in fields with a column for each component, as a state stores them."""

    def __init__(self, shape: ParticleShape, count: int) -> None:
        self.shape, self.count, real = shape, count, runtime.current().real
        self.rod = shape.rod()
        axes, exponents = shape.superquadric() or ((1.0,) * 3, (2.0,) * 3)
        self.axes, self.exponents, self.ellipsoid = axes, exponents, max(exponents) == 2
        self.c, self.p, self.q, self.out = (
            [ti.field(real, count) for _ in range(n)] for n in (3, 4, 4, VALUES)
        )

    def place(self, draw: np.random.Generator) -> None:
        """Place the pairs: separations at which support planes along a random normal are a gap apart."""
        self.turns = [Rotation.random(self.count, rng=draw) for _ in range(2)]
        normal = draw.normal(size=(self.count, 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        points = [turn.apply(self.shape.support(turn.apply(normal, inverse=True))) for turn in self.turns]
        gap = draw.uniform(NEAR, FAR, self.count) * self.shape.equal_volume_radius()
        self.separation = sum(points) + gap[:, None] * normal
        quaternions = [turn.as_quat(scalar_first=True) for turn in self.turns]
        real = np.float64 if runtime.current().precision == "f64" else np.float32
        for columns, values in (
            (self.c, self.separation),
            (self.p, quaternions[0]),
            (self.q, quaternions[1]),
        ):
            for column, value in zip(columns, values.T, strict=True):
                column.from_numpy(np.ascontiguousarray(value, real))

    def gaps(self) -> np.ndarray:
        """The gaps that a kernel has computed."""
        return self.out[0].to_numpy()


@ti.func
def vector(columns: ti.template(), m):
    """The vector of pair m."""
    return ti.Vector([column[m] for column in ti.static(columns)])


@ti.func
def axis(q):
    """The z axis of a particle."""
    turn = rotation_matrix(q)
    return ti.Vector([turn[0, 2], turn[1, 2], turn[2, 2]])


@ti.kernel
def run_rods(pairs: ti.template(), sweeps: ti.i32):
    """Compute all pairs several times, in lanes as the sums of a step do."""
    ti.loop_config(serialize=True)
    for _ in range(sweeps):
        half, radius = ti.cast(pairs.rod[0], float), ti.cast(pairs.rod[1], float)
        for block in range(pairs.count // LANES):
            lanes = [ti.Vector([0.0] * LANES) for _ in ti.static(range(VALUES))]
            for lane in range(LANES):
                m = block * LANES + lane
                axis_i, axis_j = axis(vector(pairs.p, m)), axis(vector(pairs.q, m))
                gap, n, x, y = closest_rods(vector(pairs.c, m), axis_i, half, radius, axis_j, half, radius)
                lanes[0][lane] = gap
                for k in ti.static(range(3)):
                    lanes[1 + k][lane], lanes[4 + k][lane], lanes[7 + k][lane] = n[k], x[k], y[k]
            for lane in range(LANES):
                for k in ti.static(range(VALUES)):
                    pairs.out[k][block * LANES + lane] = lanes[k][lane]


@ti.kernel
def run_superquadrics(pairs: ti.template(), family: ti.template(), far: ti.f64, sweeps: ti.i32):
    """Compute all pairs several times."""
    ti.loop_config(serialize=True)
    for _ in range(sweeps):
        a = ti.Vector([ti.cast(one, float) for one in ti.static(pairs.axes)])
        g = ti.Vector([ti.cast(one, float) for one in ti.static(pairs.exponents)])
        for m in range(pairs.count):
            gap, n, x, y = closest_superquadrics(
                family, vector(pairs.c, m), vector(pairs.p, m), a, g, vector(pairs.q, m), a, g, far
            )
            pairs.out[0][m] = gap
            for k in ti.static(range(3)):
                pairs.out[1 + k][m], pairs.out[4 + k][m], pairs.out[7 + k][m] = n[k], x[k], y[k]


def by_coal(pairs: Pairs) -> Callable[[], np.ndarray]:
    """A function that computes all gaps by coal, from shapes and transformations made beforehand."""
    shape = pairs.shape
    if isinstance(shape, SphereShape):
        body = coal.Sphere(shape.radius)
    elif isinstance(shape, SpherocylinderShape):
        body = coal.Capsule(shape.radius, shape.length)
    else:
        body = coal.Ellipsoid(*shape.superquadric()[0])
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    first, second = (
        [coal.Transform3s(matrix, place) for matrix, place in zip(turn.as_matrix(), places, strict=True)]
        for turn, places in zip(pairs.turns, (np.zeros_like(pairs.separation), pairs.separation), strict=True)
    )
    at = list(zip(first, second, strict=True))

    def distances() -> np.ndarray:
        gaps = []
        for one, other in at:
            result.clear()
            gaps.append(coal.distance(body, one, body, other, request, result))
        return np.array(gaps)

    return distances


def timed(work: Callable[[], object], count: int) -> float:
    """Return the CPU time of a call, ns a pair."""
    rest()
    begin = time.process_time()
    work()
    return (time.process_time() - begin) / count * 1e9


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--pairs", type=int, default=4096)
    options.add_argument("--turns", type=int, default=7)
    options.add_argument("--precision", choices=("f32", "f64"), default="f64")
    options.add_argument("--arithmetic", choices=("strict", "fast"), default="strict")
    given = options.parse_args()
    count = given.pairs // LANES * LANES
    runtime.init(device="cpu", precision=given.precision, arithmetic=given.arithmetic, threads=1)
    print(f"{processor()['model name']}, {runtime.current().described}, coal {coal.__version__}")
    print(f"{count} pairs, ns of CPU a pair")
    print("| shape | tisim | tisim, far | coal from Python | largest difference of gaps |")
    print("|---|---|---|---|---|")
    for name, shape in CASES.items():
        print(f"| {name} | {' | '.join(measure(shape, count, given.turns))} |", flush=True)


@in_taichi_thread
def measure(shape: ParticleShape, count: int, turns: int) -> list[str]:
    """Return the cells of a shape."""
    pairs = Pairs(shape, count)
    pairs.place(np.random.default_rng(0))
    known = pairs.rod is not None or pairs.ellipsoid
    peer = by_coal(pairs) if known else None
    sweeps = 200 if pairs.rod is not None else 5
    limit = LIMIT * shape.equal_volume_radius()

    def near(sweeps: int = sweeps, far: float = 1e30) -> None:
        if pairs.rod is not None:
            run_rods(pairs, sweeps)
        else:
            run_superquadrics(pairs, ELLIPSOIDS if pairs.ellipsoid else SUPERQUADRICS, far, sweeps)
        ti.sync()

    near(1)
    difference = f"{np.abs(peer() - pairs.gaps()).max():.0e}" if peer else ""
    own, cut, others = [], [], []
    for _ in range(turns):
        own.append(timed(near, sweeps * count))
        if pairs.rod is None:
            cut.append(timed(lambda: near(far=limit), sweeps * count))
        if peer:
            others.append(timed(peer, count))
    return [spread(times) if times else "" for times in (own, cut, others)] + [difference]


if __name__ == "__main__":
    main()
