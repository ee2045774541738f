"""Voronoi cells: the space that is closer to the centre of a particle than to any other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import QhullError, Voronoi, cKDTree

from tisim.analysis.bounding_ellipsoid import Ellipsoid
from tisim.analysis.separations import Sides, vectors_of, with_images
from tisim.errors import InputError, must

SHELL = 4.0
"""Images are taken from this many mean distances of particles beyond the faces of a periodic box, and from
farther away where cells reach there."""


class ShellVolumes(NamedTuple):
    """Shell volumes are the mean Voronoi volume (m^3) of the particles in each shell, NaN where none counts,
    and the number of those and of those that are left out."""

    volume: np.ndarray
    number: np.ndarray
    left_out: np.ndarray


def voronoi_volumes(position: np.ndarray, sides: Sides = None) -> np.ndarray:
    """Return the volume (m^3) of the Voronoi cell of each position (n, 3), m; NaN of one that goes on without
    end, as at the surface of a sample in open space; shape (n,).

    sides : those of a box that is periodic, as ``near`` takes them; then the cells fill it, however long or
    crowded it is. Sizes of particles do not count: a face is half-way between two centres. InputError is
    raised for particles in a plane, and where cells do not fill the box, such as of a lattice to all bits.

    Source: G. Voronoi, J. Reine Angew. Math. 134 (1908) 198.
    """
    return _cells(np.asarray(position, float), sides)[0]


def voronoi_by_shell(position: np.ndarray, ellipsoid: Ellipsoid, shells: int) -> ShellVolumes:
    """Return the mean Voronoi volume in concentric shells of equal volume, of one shape, from the centre of
    an ellipsoid to its surface.

    A particle is in the shell of its centre. Cells at the surface are open, or reach far into empty space:
    those that are not within the ellipsoid as a whole are left out, and counted.

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
    """Return the diagram of particles and as many of their images as have a part in their cells."""
    periodic = np.diag(vectors)[np.diag(vectors) > 0]
    if not len(periodic):
        return Voronoi(r)
    # Along an axis without images cells at the surface are open, however many images there are.
    if len(periodic) < 3:
        return Voronoi(_with_layers(r, float(periodic.max()), vectors))
    reach = SHELL * float(np.cbrt(np.prod(periodic) / len(r)))
    while True:
        try:
            diagram = Voronoi(_with_layers(r, reach, vectors))
            if reach >= _farthest(vectors).max() or _is_whole(diagram, r, vectors):
                return diagram
        except QhullError:
            # All in a plane, of which there may be images farther away.
            if reach >= periodic.max():
                raise
        reach *= 2


def _farthest(vectors: np.ndarray) -> np.ndarray:
    """Return how far (m) beyond the faces along each axis there may be images with a part in the cells of
    particles: a side, as no cell reaches farther than half of one; along an axis whose vector leans that is
    not so, and has no limit here."""
    return np.where(np.count_nonzero(vectors, axis=1) > 1, np.inf, np.diag(vectors))


def _with_layers(position: np.ndarray, reach: float, vectors: np.ndarray) -> np.ndarray:
    """Return positions (m) inside the periodic box, then those of all images at most ``reach`` (m) outside,
    and not farther than any have a part in cells: of as many layers along each axis as it takes."""
    sides = np.diag(vectors)
    places = with_images(position, 0.0, vectors)[0][: len(position)]
    beyond = np.minimum(reach, _farthest(vectors))
    layers = np.ceil(np.divide(beyond, sides, out=np.zeros(3), where=sides > 0))
    # A box that leans carries its layers along another axis.
    lean = np.abs(vectors - np.diag(sides)).T @ layers
    layers += np.ceil(np.divide(lean, sides, out=np.zeros(3), where=sides > 0))
    turns = np.stack(np.meshgrid(*(np.arange(-n, n + 1) for n in layers), indexing="ij"), -1).reshape(-1, 3)
    images = [places + turn @ vectors for turn in turns if turn.any()]
    outside = np.concatenate([places[:0], *images])
    near = ((outside >= -beyond) & (outside <= sides + beyond)) | (sides == 0)
    return np.vstack([places, outside[near.all(axis=1)]])


def _is_whole(diagram: Voronoi, r: np.ndarray, vectors: np.ndarray) -> bool:
    """Return whether no image that was left out has a part in the cells of the first particles: none is
    nearer to a corner of theirs than they are."""
    corners, ridge = _flat(diagram)
    ends = diagram.ridge_points[ridge].min(axis=1)
    corners, ends = corners[ends < len(r)], ends[ends < len(r)]
    if (corners < 0).any():
        return False
    places = diagram.vertices[corners]
    apart = np.linalg.norm(places - diagram.points[ends], axis=1)
    # Nothing is farther than this from an image of any particle.
    farthest = float(np.linalg.norm(np.abs(vectors).sum(axis=0)))
    if apart.max() > farthest:
        return False
    tree = cKDTree(_with_layers(r, float(apart.max()), vectors))
    nearest = tree.query(with_images(places, 0.0, vectors)[0][: len(places)])[0]
    return bool((nearest >= apart * (1 - 1e-9)).all())


def _volumes(diagram: Voronoi) -> np.ndarray:
    """Return the volumes of all cells: of pyramids, each with a facet half-way to another particle."""
    corners, ridge = _flat(diagram)
    begins = np.flatnonzero(np.diff(ridge, prepend=-1))
    following = np.arange(1, len(corners) + 1)
    following[np.append(begins[1:], len(corners)) - 1] = begins
    first = diagram.vertices[corners[begins]][ridge]
    a, b = (diagram.vertices[some] - first for some in (corners, corners[following]))
    area = np.linalg.norm(np.add.reduceat(np.cross(a, b), begins), axis=1) / 2
    area[np.minimum.reduceat(corners, begins) < 0] = np.nan
    i, j = diagram.ridge_points.T
    part = area * np.linalg.norm(diagram.points[i] - diagram.points[j], axis=1) / 6
    number = len(diagram.points)
    return np.asarray(np.bincount(i, part, number) + np.bincount(j, part, number))


def _flat(diagram: Voronoi) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of all facets, in their order around each, and the facet that each is of."""
    sizes = [len(corners) for corners in diagram.ridge_vertices]
    return np.concatenate(diagram.ridge_vertices), np.repeat(np.arange(len(sizes)), sizes)
