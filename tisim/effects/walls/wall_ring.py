"""Contacts of a grain that blocks a round outlet, or that touches a wall at more points than can be stored.

Facets whose directions differ by less than 15 degrees share one contact. Each has a weight that changes
smoothly as the grain moves. Otherwise the choice among the facets of a ring would be arbitrary, and a grain
in the middle of the ring would be pushed aside. The weight of a facet is

    w_f = 1 / sum over g of K(n_f . n_g) min(1, h_g / h_f),    K(x) = (x - ALIKE) / (1 - ALIKE), from 0 on

with its direction n and its depth h within the interaction range of the laws. Facets that meet at an edge or
a vertex, which is the nearest point of both, therefore count once. Contacts are then combined into six
bundles, one for each direction along an axis of the body. A facet contributes to the bundle of an axis a that
it faces with the weight (n_f . a)^2; these weights add up to 1. A bundle acts as one contact of depth h along
G, and its force is multiplied by |G|:

    h^(5/2) = sum w_f (n_f . a)^2 h_f^(5/2),    G = sum w_f (n_f . a)^2 (h_f / h)^(3/2) n_f

For Hertzian forces the bundles together give the force of all contacts; for other laws nearly so.
"""

from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti
from tisim.effects.walls.wall_search import ALIKE, BEHIND, CONTACTS, Faces
from tisim.numerics import elementary

DOUBTFUL = 3
"""Smallest number of contacts that may belong to a ring; a groove or a round corner gives two."""
LEAST_PUSH = 1e-25
"""A bundle with a smaller (h / touching)^(3/2) is empty and results from rounding."""


class Doubting:
    """Doubting finds out whether a facet was rejected as a contact only because its direction is similar to
    the direction of a contact found (the rows of a matrix).

    ``told`` : the distance (m) within which laws act, then 1 if there is such a facet.
    """

    @ti.func
    def consider(self, r, place, told, found, number):
        out, distance, result = r - place, (r - place).norm(), told
        behind, alike = False, False
        for q in range(number):
            along = out[0] * found[q, 0] + out[1] * found[q, 1] + out[2] * found[q, 2]
            behind = behind or found[q, 3] - along <= BEHIND * distance
            alike = alike or along > ALIKE * distance
        if distance < told[0] and alike and not behind:
            result[1] = 1.0
        return result


class Sharing:
    """Sharing sums the number of facets that share the contact of one of them, given by its direction and
    depth ``facet``."""

    @ti.func
    def consider(self, r, place, shares, facet, touching):
        out, distance = r - place, (r - place).norm()
        result, depth = shares, touching - distance
        if depth > 0.0:
            cosine = (out[0] * facet[0] + out[1] * facet[1] + out[2] * facet[2]) / distance
            alike = ti.min(ti.max((cosine - ALIKE) / (1.0 - ALIKE), 0.0), 1.0)
            result += alike * ti.min(1.0, depth / facet[3])
        return result


class Bundling:
    """Bundling adds the facets of a wall to bundles, rows of a matrix: h^(5/2), then h^(3/2) G, with depths
    in units of ``touching``; two rows for each axis, one for each sense."""

    def __init__(self, faces: Faces) -> None:
        self.faces, self.sharing = faces, Sharing()

    @ti.func
    def consider(self, r, place, bundles, given, touching):
        out, distance = r - place, (r - place).norm()
        result, depth = bundles, touching - distance
        if depth > 0.0:
            n = out / distance
            facet = ti.Vector([n[0], n[1], n[2], depth])
            w, reach = ti.cast(given[0], ti.i32), given[1]
            shares = self.faces.all(w, r, reach, 0.0 * depth, self.sharing, facet, touching)
            h = depth / touching
            push = h * ti.sqrt(h) / shares
            for axis in ti.static(range(3)):
                row, part = ti.select(n[axis] > 0.0, 2 * axis, 2 * axis + 1), n[axis] * n[axis] * push
                result[row, 0] += h * part
                for k in ti.static(range(3)):
                    result[row, 1 + k] += part * n[k]
        return result


class WallRing:
    """A wall ring combines the contacts of a grain with a bound wall into bundles if there are many."""

    if TYPE_CHECKING:
        faces: Any
        bundling: Any
        doubting: Any

    @ti.func
    def in_doubt(self, w, r, touching, reach, found, number):
        """Return whether the choice of contacts among similar facets depends on their depths alone."""
        told = ti.Vector([touching, 0.0 * touching])
        if number >= DOUBTFUL:
            told = self.faces.all(w, r, reach, told, self.doubting, found, number)
        return told[1] > 0.0

    @ti.func
    def bundles(self, s, w, r, touching, reach):
        """Return the bundles of a grain at r (m) as contacts: their number, and the rows of ``contacts``."""
        found, number = ti.Matrix.zero(s.real, CONTACTS, 5), 0
        # Facets farther than this are in no bundle.
        near = ti.min(reach, touching)
        given = ti.Vector([ti.cast(w, s.real), near])
        empty = ti.Matrix.zero(s.real, CONTACTS, 4)
        rows = self.faces.all(w, r, near, empty, self.bundling, given, touching)
        for b in range(CONTACTS):
            push = ti.Vector([rows[b, 1], rows[b, 2], rows[b, 3]])
            depth, size = elementary.pow(rows[b, 0], 0.4), push.norm()
            if size > LEAST_PUSH:
                for axis in ti.static(range(3)):
                    found[number, axis] = push[axis] / size
                found[number, 3] = touching * (1.0 - depth)
                found[number, 4] = size / (depth * ti.sqrt(depth))
                number += 1
        return number, found
