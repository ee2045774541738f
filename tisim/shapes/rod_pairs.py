"""The shortest distance of two spheres and of two rods, in closed form without a branch."""

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.vectors import farthest_axis

CROSSING = 1e-6
"""Axes that cross at a distance below this part of their lengths take their normal from the product of their
directions, because their difference is then lost to rounding."""


def parallel_sine() -> float:
    """Return the sine of the angle below which rods count as parallel: 64 rounding units, to which the
    direction of the common normal is known."""
    return 2.0**-46 if runtime.current().precision == "f64" else 2.0**-17


@ti.func
def closest_spheres(separation, radius_i, radius_j, concentric):
    """Return gap (m), unit normal from i to j, and the points of contact (m), each relative to the centre of
    its sphere.

    separation : centre of j minus centre of i (m). radius_i, radius_j : m. The gap of spheres that overlap is
        negative. concentric : normal of concentric spheres, a unit vector. If it is the same for all, many in
        one place are moved apart along a line only.
    """
    size = separation.norm()
    normal = ti.select(size > 0.0, separation / ti.select(size > 0.0, size, 1.0), concentric)
    return size - radius_i - radius_j, normal, radius_i * normal, -radius_j * normal


@ti.func
def closest_rods(separation, axis_i, half_i, radius_i, axis_j, half_j, radius_j):
    """Return gap (m), unit normal from i to j, and the points of contact (m), each relative to the centre of
    its rod.

    separation : centre of j minus centre of i (m). axis_i, axis_j : unit vectors along the segments. half_i,
        half_j : half the lengths of the segments (m), 0 for spheres. radius_i, radius_j : m.

    The gap is the distance of the segments minus both radii. If it is negative, its amount is the depth of
    the overlap as B16 and granular codes define it. It is the shortest translation that separates the rods,
    except when the segments nearly cross close to their ends, where moving a rod along its axis may be
    shorter. With r the separation, b = e_i . e_j and n = e_i x e_j, the points nearest to each other on the
    infinite lines are l e_i and r + m e_j:

        l = n . (r x e_j) / n^2,    m = b l - r . e_j

    The closest points of the segments follow by three limits, l to its segment, m for this l, and l for this
    m: the distance is convex in l and m. Rods that are parallel to rounding touch at the middle of the length
    that they have beside each other. Where axes intersect, the normal is along n; for parallel axes that
    overlap it is any direction across them.

    Source: C. Vega and S. Lago, Computers & Chemistry 18 (1994) 55, for the distance of segments; chapter 2
    of B16 for rods.
    """
    b, along_i, along_j = axis_i.dot(axis_j), separation.dot(axis_i), separation.dot(axis_j)
    across = axis_i.cross(axis_j)
    square = across.norm_sqr()
    apart = square > ti.static(parallel_sine() ** 2)
    beside = 0.5 * (ti.max(-half_i, along_i - half_j) + ti.min(half_i, along_i + half_j))
    line = across.dot(separation.cross(axis_j)) / ti.select(apart, square, 1.0)
    on_i = ti.min(ti.max(ti.select(apart, line, beside), -half_i), half_i)
    on_j = ti.min(ti.max(b * on_i - along_j, -half_j), half_j)
    on_i = ti.min(ti.max(along_i + b * on_j, -half_i), half_i)
    k = separation + on_j * axis_j - on_i * axis_i
    size = k.norm()
    inner = (ti.abs(on_i) < half_i) & (ti.abs(on_j) < half_j)
    crossing = inner & (square > CROSSING * CROSSING) & (size < CROSSING * (half_i + half_j))
    side = ti.select(across.dot(separation) < 0.0, -1.0, 1.0)
    along = ti.select(crossing, side * across, ti.select(size > 0.0, k, axis_i.cross(farthest_axis(axis_i))))
    normal = 1.0 / along.norm() * along
    return (
        size - radius_i - radius_j,
        normal,
        on_i * axis_i + radius_i * normal,
        on_j * axis_j - radius_j * normal,
    )
