"""A grain that blocks a round outlet, or touches a wall in more places than it remembers.

Facets whose directions differ by less than 15 degrees share one contact, in parts that change smoothly as the
grain moves: of a ring of facets it would else be chance which ones count, and a grain in its middle would be
pushed aside. The part of a facet is

    w_f = 1 / sum over g of K(n_f . n_g) min(1, h_g / h_f),    K(x) = (x - ALIKE) / (1 - ALIKE), from 0 on

where n is its direction, and h how deep it is within the distance at which laws act. So facets that meet at
an edge or a vertex, where both have their nearest place, count once. Then the contacts are taken in six
bundles, by the axes of the body: a facet belongs to the bundle of an axis a by (n_f . a)^2, if that points
its way, which add up to 1. A bundle acts as one contact of depth h, along G, with a force multiplied by |G|:

    h^(5/2) = sum w_f (n_f . a)^2 h_f^(5/2),    G = sum w_f (n_f . a)^2 (h_f / h)^(3/2) n_f

With Hertzian forces the bundles together push as all contacts do; with others nearly so.
"""

from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti
from tisim.effects.walls.wall_search import ALIKE, BEHIND, CONTACTS, Faces
from tisim.numerics import elementary

DOUBTFUL = 3
"""So many contacts may be those of a ring; two are where a grain lies in a groove or a round corner."""
LEAST_PUSH = 1e-25
"""A bundle of less (h / touching)^(3/2) is empty: it is what rounding leaves."""


class Doubting:
    """Doubting finds whether there is a facet that is no contact beside those found, rows of a matrix, only
    because it looks the same way as one of them.

    ``told`` : the distance (m) within which laws act, then 1 if there is one.
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
    """Sharing sums up how many facets share the contact of one of them, whose direction and depth are
    ``facet``."""

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
    """Bundling adds the facets of a wall to bundles, rows of a matrix: h^(5/2), then h^(3/2) G, of depths in
    parts of ``touching``; two rows for each axis, which it points along and against."""

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
    """A wall ring bundles the contacts of a grain with a wall: it is what a bound wall does where there are
    many."""

    if TYPE_CHECKING:
        faces: Any
        bundling: Any
        doubting: Any

    @ti.func
    def in_doubt(self, w, r, touching, reach, found, number):
        """Return whether it depends on the depths of facets alone which of them are those found."""
        told = ti.Vector([touching, 0.0 * touching])
        if number >= DOUBTFUL:
            told = self.faces.all(w, r, reach, told, self.doubting, found, number)
        return told[1] > 0.0

    @ti.func
    def bundles(self, s, w, r, touching, reach):
        """Return the bundles of a grain at r (m) as contacts: how many, and the rows of ``contacts``."""
        found, number = ti.Matrix.zero(s.real, CONTACTS, 5), 0
        # What is farther than that is in no bundle.
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
