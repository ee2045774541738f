"""Voronoi cells: the region closer to the centre of a particle than to any other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import QhullError, Voronoi, cKDTree

from tisim.analysis.bounding_ellipsoid import Ellipsoid
from tisim.analysis.separations import Sides, vectors_of, with_images
from tisim.errors import InputError, must

SHELL = 4.0
"""Images within this number of mean particle distances outside a periodic box are included first; farther
ones are added if the cells extend there."""


class ShellVolumes(NamedTuple):
    """The mean Voronoi volume (m^3) of the counted particles in each shell, NaN if there are none, the number
    of counted particles, and the number left out."""

    volume: np.ndarray
    number: np.ndarray
    left_out: np.ndarray


class VoronoiFacets(NamedTuple):
    """Facets of Voronoi cells, each from both of its sides: index of the particle of a cell, index of its
    neighbour, neighbour minus particle (m, shape (k, 3)), and area (m^2)."""

    particle: np.ndarray
    neighbour: np.ndarray
    separation: np.ndarray
    area: np.ndarray


def voronoi_volumes(position: np.ndarray, sides: Sides = None) -> np.ndarray:
    """Return the volume (m^3) of the Voronoi cell of each position (n, 3), m; NaN for unbounded cells, as at
    the surface of a sample in open space; shape (n,).

    sides : side lengths of a periodic box, as for ``near``; the cells then fill the box, for any aspect ratio
        and distribution. The radii of particles have no effect: a face is half-way between two centres.
        InputError is raised for particles in a plane, and if the cells do not fill the box, which can happen
        for an exact lattice.

    Source: G. Voronoi, J. Reine Angew. Math. 134 (1908) 198.
    """
    return _cells(np.asarray(position, float), sides)[0]


def voronoi_by_shell(position: np.ndarray, ellipsoid: Ellipsoid, shells: int) -> ShellVolumes:
    """Return the mean Voronoi volume in concentric ellipsoidal shells of equal volume, from the centre of an
    ellipsoid to its surface.

    A particle belongs to the shell that contains its centre. Cells at the surface are unbounded, or extend
    far into empty space: cells that are not completely inside the ellipsoid are left out, and counted.

    Source: L21 section 4.2.2.3, which does not say how it takes cells at the surface.
    """
    r = np.asarray(position, float)
    must(shells >= 1, "shells", "1 or above", shells)
    volume, diagram = _cells(r, None)
    regions = [diagram.regions[diagram.point_region[i]] for i in range(len(r))]
    outside = ellipsoid.level(diagram.vertices) > 1
    closed = np.array([not outside[region].any() for region in regions]) & np.isfinite(volume)
    shell = (ellipsoid.level(r) ** 3 * shells).astype(int)
    known = shell < shells
    count, everybody = (np.bincount(shell[part], minlength=shells) for part in (known & closed, known))
    total = np.bincount(shell[known & closed], volume[known & closed], shells)
    mean = total / np.where(count > 0, count, np.nan)
    return ShellVolumes(mean, count, everybody - count)


def voronoi_facets(position: np.ndarray, sides: Sides = None) -> VoronoiFacets:
    """Return the bounded facets of the Voronoi cells of positions (n, 3), m.

    sides : side lengths of a periodic box, as for ``voronoi_volumes``.
    """
    r, vectors = np.asarray(position, float), vectors_of(sides)
    diagram = _cells(r, sides)[1]
    ends, area = diagram.ridge_points, _areas(diagram)
    ends, area = (np.concatenate([ends, ends[:, ::-1]]), np.tile(area, 2))
    kept = (ends[:, 0] < len(r)) & np.isfinite(area)
    i, j = ends[kept].T
    points = diagram.points
    # Images lie on particles if they are moved into the box.
    inside, of = with_images(points[: len(r)], 0.0, vectors)
    number = of[cKDTree(inside).query(with_images(points, 0.0, vectors)[0][: len(points)])[1]]
    return VoronoiFacets(i, number[j], points[j] - points[i], area[kept])


def _cells(r: np.ndarray, sides: Sides) -> tuple[np.ndarray, Voronoi]:
    """Return the volumes of cells and their diagram, in which particles come first."""
    must(len(r) > 4, "particles", "more than 4", len(r))
    must(bool(np.isfinite(r).all()), "positions", "finite", r[~np.isfinite(r)][:1])
    try:
        diagram = _diagram(r, vectors_of(sides))
    except QhullError:
        raise InputError("particles must be points not all in a plane; received points in a plane") from None
    volumes, box = _volumes(diagram)[: len(r)], float(np.prod(np.diag(vectors_of(sides))))
    filled = not box or np.isclose(volumes.sum(), box, rtol=1e-6)
    must(filled, "the sum of the cells", f"the volume of the box, {box:g} m^3", volumes.sum())
    return volumes, diagram


def _diagram(r: np.ndarray, vectors: np.ndarray) -> Voronoi:
    """Return the diagram of particles and all images that affect their cells."""
    periodic = np.diag(vectors)[np.diag(vectors) > 0]
    if not len(periodic):
        return Voronoi(r)
    # With a non-periodic axis, cells at the surface are unbounded for any number of images.
    if len(periodic) < 3:
        return Voronoi(_with_layers(r, float(periodic.max()), vectors))
    reach = SHELL * float(np.cbrt(np.prod(periodic) / len(r)))
    while True:
        try:
            diagram = Voronoi(_with_layers(r, reach, vectors))
            if reach >= _farthest(vectors).max() or _is_whole(diagram, r, vectors):
                return diagram
        except QhullError:
            # The points lie in a plane; images farther away may lie outside of it.
            if reach >= periodic.max():
                raise
        reach *= 2


def _farthest(vectors: np.ndarray) -> np.ndarray:
    """Return the distance (m) beyond the faces along each axis within which images can affect the cells of
    particles. It is one side, because no cell extends farther than half a side. For a tilted axis this does
    not hold, and the distance is infinite."""
    return np.where(np.count_nonzero(vectors, axis=1) > 1, np.inf, np.diag(vectors))


def _with_layers(position: np.ndarray, reach: float, vectors: np.ndarray) -> np.ndarray:
    """Return positions (m) inside the periodic box, followed by all images at most ``reach`` (m) outside that
    can affect the cells, from the necessary number of image layers along each axis."""
    sides = np.diag(vectors)
    places = with_images(position, 0.0, vectors)[0][: len(position)]
    beyond = np.minimum(reach, _farthest(vectors))
    layers = np.ceil(np.divide(beyond, sides, out=np.zeros(3), where=sides > 0))
    # The layers of a tilted box extend along another axis.
    lean = np.abs(vectors - np.diag(sides)).T @ layers
    layers += np.ceil(np.divide(lean, sides, out=np.zeros(3), where=sides > 0))
    turns = np.stack(np.meshgrid(*(np.arange(-n, n + 1) for n in layers), indexing="ij"), -1).reshape(-1, 3)
    images = [places + turn @ vectors for turn in turns if turn.any()]
    outside = np.concatenate([places[:0], *images])
    near = ((outside >= -beyond) & (outside <= sides + beyond)) | (sides == 0)
    return np.vstack([places, outside[near.all(axis=1)]])


def _is_whole(diagram: Voronoi, r: np.ndarray, vectors: np.ndarray) -> bool:
    """Return whether no omitted image affects the cells of the first particles, which means that no image is
    nearer to a corner of a cell than its particle."""
    corners, ridge = _flat(diagram)
    ends = diagram.ridge_points[ridge].min(axis=1)
    corners, ends = corners[ends < len(r)], ends[ends < len(r)]
    if (corners < 0).any():
        return False
    places = diagram.vertices[corners]
    apart = np.linalg.norm(places - diagram.points[ends], axis=1)
    # The distance from any point to the nearest image of any particle is at most this.
    farthest = float(np.linalg.norm(np.abs(vectors).sum(axis=0)))
    if apart.max() > farthest:
        return False
    tree = cKDTree(_with_layers(r, float(apart.max()), vectors))
    nearest = tree.query(with_images(places, 0.0, vectors)[0][: len(places)])[0]
    return bool((nearest >= apart * (1 - 1e-9)).all())


def _volumes(diagram: Voronoi) -> np.ndarray:
    """Return the volumes of all cells as sums of pyramids over the facets, which lie half-way to
    neighbours."""
    i, j = diagram.ridge_points.T
    part = _areas(diagram) * np.linalg.norm(diagram.points[i] - diagram.points[j], axis=1) / 6
    number = len(diagram.points)
    return np.asarray(np.bincount(i, part, number) + np.bincount(j, part, number))


def _areas(diagram: Voronoi) -> np.ndarray:
    """Return the areas of all facets; NaN for unbounded ones."""
    corners, ridge = _flat(diagram)
    begins = np.flatnonzero(np.diff(ridge, prepend=-1))
    following = np.arange(1, len(corners) + 1)
    following[np.append(begins[1:], len(corners)) - 1] = begins
    first = diagram.vertices[corners[begins]][ridge]
    a, b = (diagram.vertices[some] - first for some in (corners, corners[following]))
    area = np.linalg.norm(np.add.reduceat(np.cross(a, b), begins), axis=1) / 2
    area[np.minimum.reduceat(corners, begins) < 0] = np.nan
    return np.asarray(area)


def _flat(diagram: Voronoi) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of all facets, in order around each facet, and the facet index of each corner."""
    sizes = [len(corners) for corners in diagram.ridge_vertices]
    return np.concatenate(diagram.ridge_vertices), np.repeat(np.arange(len(sizes)), sizes)
