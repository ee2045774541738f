"""Where a grain touches a wall made of several surfaces.

Each face of a surface has a place nearest to the grain. Not all of those that lie within the grain are
contacts: of two triangles in a plane, or two faces at a convex edge, the grain touches the nearer one, and
the nearest place of the other is only where its face begins. So contacts are taken one by one, the deepest
first. A further place is a contact if it lies in front of the tangent planes of those before, as at a concave
edge, and in another direction: facets of a curved wall that differ by less than ALIKE count as one. So the
force follows from the least distance wherever a grain moves over an edge, and no energy is made.
"""

from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti

CONTACTS = 6
"""A grain remembers so many contacts with one wall, as many as a box has faces; of more it makes bundles."""
ALIKE = 0.966
"""Two contacts of a grain with one wall whose directions have a larger cosine, so below 15 degrees, are
one."""
BEHIND = 1e-3
"""A place counts as behind a tangent plane up to so far in front of it, in parts of the distance."""


REACH = 1.5
"""Surfaces are looked for within so many radii, to know for how long none will be touched."""


@ti.func
def explained(out, distance, found, number):
    """Return whether a place at ``out`` (m) from it to the grain's centre, ``distance`` away, is no contact
    beside a number of those found: rows of a matrix, direction to the centre and distance (m)."""
    hit = False
    for q in range(number):
        along = out[0] * found[q, 0] + out[1] * found[q, 1] + out[2] * found[q, 2]
        hit = hit or found[q, 3] - along <= BEHIND * distance or along > ALIKE * distance
    return hit


class Faces:
    """These are the faces of a wall: lists of surfaces, of which there are any, and triangles, if there is a
    mesh."""

    def __init__(self, surfaces: tuple[Any, ...], mesh: Any, has_mesh: bool) -> None:
        self.surfaces, self.mesh, self.has_mesh = surfaces, mesh, has_mesh

    @ti.func
    def all(self, w, r, reach, best, search: ti.template(), found, number):  # type: ignore[valid-type]
        """Return what ``search.consider`` makes of all faces, and of the triangles within ``reach`` (m) of r,
        one after another, from ``best`` on."""
        for each in ti.static(self.surfaces):
            for k in range(each.size(w)):
                for c in range(ti.cast(each.faces(w, k), ti.i32)):
                    best = search.consider(r, each.nearest(w, k, c, r), best, found, number)
        if ti.static(self.has_mesh):
            best = self.mesh.search(r, reach, best, search, found, number)
        return best


class WallSearch:
    """A wall search finds where a grain touches a wall: it is what a bound wall does with its shapes.

    flat : the list of its planes. faces : those of its surfaces. mesh : its triangles, where ``has_mesh``.
    """

    if TYPE_CHECKING:
        flat: Any
        faces: Any
        mesh: Any
        has_mesh: Any
        bundles: Any
        in_doubt: Any

    @ti.func
    def consider(self, r, place, best, found, number):
        """Return the better contact of a grain at r (m): at a place (m), or ``best``, its distance and where
        it is."""
        out, result = r - place, best
        distance = out.norm()
        nearer = distance < best[0]
        if nearer and not explained(out, distance, found, number):
            result = ti.Vector([distance, place[0], place[1], place[2]])
        return result

    @ti.func
    def deepest(self, w, r, limit, reach, found, number):
        """Return distance (m) and place of the nearest contact beside those found, of triangles within
        ``reach`` (m), where that is above 0; the distance is ``limit`` where there is none within it."""
        best = ti.Vector([limit, r[0], r[1], r[2]])
        return self.faces.all(w, r, reach, best, self, found, number)

    @ti.func
    def contacts(self, s, w, i, r, touching):
        """Return the contacts of grain i, which is at r (m) beside the shapes, with surfaces: how many, and
        their directions, their distances, of ``touching`` (m) at most, and by how much their forces are
        multiplied; and how far it is from surfaces at least, where there is none."""
        found, number, searching = ti.Matrix.zero(s.real, CONTACTS, 5), 0, 1
        clear = ti.cast(ti.math.inf, s.real)
        limit, reach = clear, REACH * touching
        if ti.static(self.has_mesh):
            gap = self.mesh.clearance(r)
            clear, reach = ti.max(gap, reach), ti.select(gap < reach, reach, 0.0)
        while searching > 0:
            best = self.deepest(w, r, limit, reach, found, number)
            if number == 0:
                clear = ti.min(clear, best[0])
            if best[0] >= touching:
                searching = 0
            elif number == CONTACTS:
                number, searching = CONTACTS + 1, 0
            else:
                for axis in ti.static(range(3)):
                    found[number, axis] = (r[axis] - best[1 + axis]) / best[0]
                found[number, 3], found[number, 4] = best[0], 1.0
                number, limit = number + 1, touching
        if number > CONTACTS or self.in_doubt(w, r, touching, reach, found, number):
            number, found = self.bundles(s, w, r, touching, reach)
        return number, found, clear

    @ti.func
    def from_planes(self, w, r):
        """Return the distance (m) of r from the nearest plane."""
        clear = ti.cast(ti.math.inf, float)
        for k in range(self.flat.size(w)):
            clear = ti.min(clear, self.flat.distance(w, k, r))
        return clear
