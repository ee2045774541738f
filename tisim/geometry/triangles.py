"""A surface made of triangles, such as from an STL file."""

import hashlib
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.arrays import Rows, equal
from tisim.components.component import parameter
from tisim.errors import MeshWarning, Words, is_number, must, printable
from tisim.files import regular_file
from tisim.geometry.mesh_check import MeshCheck
from tisim.geometry.mesh_files import MeshFile
from tisim.geometry.shape import SEAM, Shape
from tisim.geometry.triangle_grid import MOST_LISTED, TriangleGrid

MOST_DISTANCES = 2_000_000
"""For more pairs of positions and triangles, ``distances`` returns infinity for all positions."""

PAIRS_AT_ONCE = 100_000
"""Number of pairs of a position and a triangle that ``distances`` processes at a time, about 10 MB."""


class TriangulatedSurface(Shape):
    """A surface of triangles, with particles on either side of it, such as from an STL file.

    It is the same in all worlds of a batch. ``TriangulatedSurface.read("drum.stl", scale=1e-3)`` reads a
    file; triangles without area are left out. In a scene file, use ``surface = {kind =
    "triangulated_surface", file = "drum.stl", scale = 1e-3}``, with a path relative to the folder of the
    scene file. Particles find nearby triangles in a grid of cells.
    """

    vertices: Rows = parameter("m", "positions of the vertices", examples=[((0, 0, 0), (1, 0, 0), (0, 1, 0))])
    faces: Rows = parameter(
        "", "indices of the three vertices of each triangle, from 0", examples=[((0, 1, 2),)]
    )

    if TYPE_CHECKING:
        begin: ClassVar[Any]
        listed: ClassVar[Any]

    @classmethod
    def read(cls, path: str | Path, scale: float = 1.0, where: str = "surface") -> Self:
        """Return the surface in a file: STL, OBJ, or another format, such as PLY, if meshio is installed.
        ``scale`` is the length of the unit of the file in m. Polygons are cut into triangles.

        InputError, naming the surface ``where``, is raised if the file is damaged or truncated, if faces are
        not polygons, and if the scale is not above 0. A MeshWarning is given for faces that are duplicates or
        have no area.
        """
        must(is_number(scale) and scale > 0, f"{where}.scale", "a number of m above 0", scale)
        places, faces = MeshFile(Path(path), where).read()
        vertices, index = np.unique(places, axis=0, return_inverse=True)
        surface = cls(vertices=scale * vertices, faces=index.reshape(-1)[faces])
        if suspect := MeshCheck.of(surface.vertices, surface.faces).suspect():
            warnings.warn(f"{where}: {suspect} ({printable(str(path))})", MeshWarning, stacklevel=2)
        return surface

    @classmethod
    def from_files(cls, values: dict[str, Any], where: str, folder: Path) -> dict[str, Any]:
        if "file" not in values:
            return values
        others = sorted(values.keys() - {"file", "scale"})
        must(not others, where, "given a file and a scale alone, or vertices and faces", ", ".join(others))
        file, scale = values["file"], values.get("scale", 1.0)
        must(isinstance(file, str), f"{where}.file", "text", file)
        must(regular_file.exists(folder / file), f"{where}.file", "an existing file", str(folder / file))
        surface = cls.read(folder / file, scale, where)
        return {"vertices": surface.vertices, "faces": surface.faces}

    @model_validator(mode="after")
    def _indexed(self) -> Self:
        count, label = len(self.vertices), self.label
        whole = (self.faces == np.rint(self.faces)) & (self.faces >= 0) & (self.faces < count)
        rule = f"whole numbers below the number of vertices, {count}"
        must(bool(whole.all()), f"{label}.faces", rule, self.faces[~whole][:1].tolist())
        number = len(self.corners())
        must(number > 0, f"{label}.faces", "triangles with an area", Words("none"))
        must(number <= MOST_LISTED, f"{label}.faces", f"at most {MOST_LISTED} triangles", number)
        return self

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return equal(self.vertices, other.vertices) and equal(self.faces, other.faces)

    def __hash__(self) -> int:
        return hash(self.structure())

    def corners(self) -> np.ndarray:
        """Return the corners of the triangles with an area, m, shape (triangles, 3, 3)."""
        corners: np.ndarray = self.vertices[self.faces.astype(int)]
        sides = corners[:, 1:] - corners[:, :1]
        return corners[np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > 0]

    def structure(self) -> tuple[Any, ...]:
        return type(self), hashlib.sha256(self.corners().tobytes()).hexdigest()

    def remarks(self) -> dict[str, str]:
        return {"mesh": str(MeshCheck.of(self.vertices, self.faces))}

    def lookups(self) -> dict[str, np.ndarray]:
        corners = self.corners()
        grid = TriangleGrid.of(corners)
        return {
            "triangles": corners.reshape(-1, 9),
            "grid": np.array([[*grid.low, grid.width, *grid.dims]]),
            "first": grid.first,
            "begin": grid.begin[:, None],
            "listed": grid.members[:, None],
            "clear": grid.clear[:, None],
        }

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        places = self.corners().reshape(-1, 3)
        return places.min(axis=0), places.max(axis=0)

    def ends_at(self, low: np.ndarray, high: np.ndarray, reach: float) -> np.ndarray:
        corners = self.corners()
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        slopes = np.abs(normals) > SEAM * np.linalg.norm(normals, axis=1)[:, None]
        near = (corners.min(axis=1) - reach < low) | (corners.max(axis=1) + reach > high)
        bends: np.ndarray = (near & slopes).any(axis=0)
        return bends | super().ends_at(low, high, reach)

    def distances(self, places: np.ndarray) -> np.ndarray:
        corners = self.corners()
        least: np.ndarray = np.full(len(places), np.inf)
        if len(places) * len(corners) > MOST_DISTANCES:
            return least
        # Process blocks: a loop over single triangles or positions would take a minute for 10^5 of them.
        block = max(1, PAIRS_AT_ONCE // max(1, len(places)))
        for first in range(0, len(corners), block):
            least = np.minimum(least, _distances(corners[first : first + block], places))
        return least

    @ti.func
    def nearest(self, m, r):
        """Return the point (m) nearest to r on triangle m."""
        tr = ti.static(self.triangles)
        a = ti.Vector([tr[m, 0], tr[m, 1], tr[m, 2]])
        b = ti.Vector([tr[m, 3], tr[m, 4], tr[m, 5]])
        c = ti.Vector([tr[m, 6], tr[m, 7], tr[m, 8]])
        return nearest_on_triangle(a, b, c, r)

    @ti.func
    def distance(self, w, k, r):
        """Return the distance (m) of r from the nearest of all triangles."""
        least = ti.cast(ti.math.inf, float)
        for m in range(self.triangles.shape[0]):
            least = ti.min(least, (r - self.nearest(m, r)).norm())
        return least

    @ti.func
    def cells(self):
        """Return the number of cells along each axis."""
        return ti.Vector([ti.cast(self.grid[0, 4 + a], ti.i32) for a in ti.static(range(3))])

    @ti.func
    def cell(self, r):
        """Return the indices of the cell nearest to r."""
        at = ti.Vector([0, 0, 0])
        for a in ti.static(range(3)):
            index = (r[a] - self.grid[0, a]) / self.grid[0, 3]
            last = self.grid[0, 4 + a] - 1.0
            at[a] = ti.cast(ti.min(ti.max(index, 0.0), last), ti.i32)
        return at

    @ti.func
    def clearance(self, r):
        """Return a lower bound of the distance (m) from r to all triangles."""
        dims, at, beside = self.cells(), self.cell(r), 0.0 * r
        for a in ti.static(range(3)):
            low = self.grid[0, a]
            high = low + self.grid[0, 3] * self.grid[0, 4 + a]
            beside[a] = ti.max(low - r[a], ti.max(r[a] - high, 0.0))
        index = (at[0] * dims[1] + at[1]) * dims[2] + at[2]
        return ti.max(beside.norm(), self.clear[index, 0] - beside.norm())

    @ti.func
    def search(self, r, reach, best, search: ti.template(), found, number):  # type: ignore[valid-type]
        """Return the result of ``search.consider``, called for all triangles that may be within ``reach`` (m)
        of r, one after another, starting from ``best``; see tisim/effects/walls/wall_search.py."""
        dims, low, high = self.cells(), self.cell(r - reach), self.cell(r + reach)
        # If reach is not positive, no cell is searched.
        for x in range(low[0], ti.select(reach > 0.0, high[0] + 1, low[0])):
            for y, z in ti.ndrange((low[1], high[1] + 1), (low[2], high[2] + 1)):
                index = (x * dims[1] + y) * dims[2] + z
                begin, end = self.begin[index, 0], self.begin[index + 1, 0]
                for e in range(ti.cast(begin, ti.i32), ti.cast(end, ti.i32)):
                    m = ti.cast(self.listed[e, 0], ti.i32)
                    if self.is_new(m, x, y, z, low):
                        best = search.consider(r, self.nearest(m, r), best, found, number)
        return best

    @ti.func
    def is_new(self, m, x, y, z, low):
        """Return whether triangle m, which may be listed in several of the cells from ``low`` on, was in none
        of the cells before x, y, z."""
        first = [ti.max(ti.cast(self.first[m, axis], ti.i32), low[axis]) for axis in ti.static(range(3))]
        # A large triangle is not in all cells of its bounding box, so it is considered in each cell that
        # lists it.
        large = self.first[m, 0] < 0.0
        return large or (x == first[0] and y == first[1] and z == first[2])


def _distances(corners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the distance (m) of each position (m, shape (n, 3)) from the nearest of some triangles."""
    sides = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(sides[:, 0], sides[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    least = np.full((len(corners), len(places)), np.inf)
    over = np.ones(least.shape, bool)
    for begin, side in zip(np.moveaxis(corners, 1, 0), np.moveaxis(sides, 1, 0), strict=True):
        out = places - begin[:, None]
        over &= np.einsum("mni,mi->mn", out, np.cross(normals, side)) >= 0.0
        along = np.einsum("mni,mi->mn", out, side) / (side**2).sum(axis=1)[:, None]
        foot = np.clip(along, 0.0, 1.0)[..., None] * side[:, None]
        least = np.minimum(least, np.linalg.norm(out - foot, axis=2))
    above = np.abs(np.einsum("mni,mi->mn", places - corners[:, :1], normals))
    nearest: np.ndarray = np.where(over, np.minimum(least, above), least).min(axis=0)
    return nearest


@ti.func
def nearest_on_triangle(a, b, c, r):
    """Return the point nearest to r on the triangle a, b, c.

    Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.5.
    """
    ab, ac = b - a, c - a
    d1, d2 = ab.dot(r - a), ac.dot(r - a)
    d3, d4 = ab.dot(r - b), ac.dot(r - b)
    d5, d6 = ab.dot(r - c), ac.dot(r - c)
    # Areas opposite to a, b and c.
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, u = 0.0 * d1, 0.0 * d1
    if d1 <= 0.0 and d2 <= 0.0:
        v = 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        u = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        u = d2 / (d2 - d6)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        u = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - u
    else:
        v, u = vb / (va + vb + vc), vc / (va + vb + vc)
    return a + v * ab + u * ac
