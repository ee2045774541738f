"""The contacts of a grain with a wall made of several surfaces.

Each face of a surface has a point nearest to the centre of the grain. Not all such points within the grain
are contacts. Of two triangles in a plane, or two faces at a convex edge, the grain touches only the nearer
one; the nearest point of the other lies on its boundary. Contacts are therefore taken one by one, the deepest
first. A further point is a contact if it lies in front of the tangent planes of those before, as at a concave
edge, and in a different direction: facets of a curved wall whose directions differ by less than ALIKE count
as one. As a grain moves over an edge, the force then follows from the smallest distance, and no energy is
created.
"""

from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti

CONTACTS = 6
"""Contacts of a grain with one wall that are stored, as many as a box has faces; more are combined into
bundles."""
ALIKE = 0.966
"""Two contacts of a grain with one wall count as one if the cosine of their directions is larger, that is,
below 15 degrees."""
BEHIND = 1e-3
"""Tolerance within which a point in front of a tangent plane counts as behind it, over the distance."""


REACH = 1.5
"""Search radius for surfaces over the interaction range; a larger radius shows how long no surface can be
touched."""


@ti.func
def explained(out, distance, found, number):
    """Return whether a point is not a separate contact. ``out`` (m) leads from it to the grain's centre at a
    ``distance``; ``found`` has a number of contacts as rows, direction to the centre and distance (m)."""
    hit = False
    for q in range(number):
        along = out[0] * found[q, 0] + out[1] * found[q, 1] + out[2] * found[q, 2]
        hit = hit or found[q, 3] - along <= BEHIND * distance or along > ALIKE * distance
    return hit


class Faces:
    """The faces of a wall: the non-empty lists of surfaces, and the triangles if there is a mesh."""

    def __init__(self, surfaces: tuple[Any, ...], mesh: Any, has_mesh: bool) -> None:
        self.surfaces, self.mesh, self.has_mesh = surfaces, mesh, has_mesh

    @ti.func
    def all(self, w, r, reach, best, search: ti.template(), found, number):  # type: ignore[valid-type]
        """Return the result of ``search.consider`` applied in turn to all faces, and to the triangles within
        ``reach`` (m) of r, beginning with ``best``."""
        for each in ti.static(self.surfaces):
            for k in range(each.size(w)):
                for c in range(ti.cast(each.faces(w, k), ti.i32)):
                    best = search.consider(r, each.nearest(w, k, c, r), best, found, number)
        if ti.static(self.has_mesh):
            best = self.mesh.search(r, reach, best, search, found, number)
        return best


class WallSearch:
    """A wall search finds the contacts of a grain with the shapes of a bound wall.

    flat : the list of its planes. faces : the faces of its surfaces. mesh : its triangles, if ``has_mesh``.
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
        """Return the better contact of a grain at r (m): the one at a place (m), or ``best``, as distance and
        place."""
        out, result = r - place, best
        distance = out.norm()
        nearer = distance < best[0]
        if nearer and not explained(out, distance, found, number):
            result = ti.Vector([distance, place[0], place[1], place[2]])
        return result

    @ti.func
    def deepest(self, w, r, limit, reach, found, number):
        """Return distance (m) and place of the nearest further contact beside those found. Triangles are
        limited to ``reach`` (m) if that is above 0. The distance is ``limit`` if there is none within it."""
        best = ti.Vector([limit, r[0], r[1], r[2]])
        return self.faces.all(w, r, reach, best, self, found, number)

    @ti.func
    def contacts(self, s, w, i, r, touching):
        """Return the contacts of grain i, at r (m) in the body frame, with surfaces: their number and a
        matrix of directions, distances of at most ``touching`` (m) and force factors; and a lower bound of
        the distance from surfaces if there is no contact."""
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
        """Return the distance (m) from r to the nearest plane."""
        clear = ti.cast(ti.math.inf, float)
        for k in range(self.flat.size(w)):
            clear = ti.min(clear, self.flat.distance(w, k, r))
        return clear
