"""The magnetic field of any number of uniformly magnetised spheres at any place."""

from __future__ import annotations

from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.effects.base import option, parameter
from tisim.geometry.sphere import ball_distance
from tisim.sources.magnetic.magnets import Body, Magnets


class Sphere(Body):
    """A sphere, magnetised uniformly or not at all."""

    radius: float = parameter("m", "radius R", examples=[1e-3], gt=0)

    @ti.func
    def nearest(self, w, k, r):
        return ball_distance(r, self.centre(w, k), self.radius(w, k))

    @ti.func
    def flux_density(self, w, k, r):
        return self.flux(w, k, r)[0]

    @ti.func
    def flux(self, w, k, r):
        d, m, radius = r - self.centre(w, k), mu_0 * self.magnetisation(w, k), self.radius(w, k)
        size = d.norm()
        b, slope = 2.0 / 3.0 * m, 0.0 * r.outer_product(r)
        if size >= radius:
            e, part = d / size, (radius / size) ** 3 / 3.0
            along = m.dot(e)
            b = part * (3.0 * along * e - m)
            half = e.outer_product(m - 2.5 * along * e)
            slope = half + half.transpose()
            for i in ti.static(range(3)):
                slope[i, i] += along
            slope *= 3.0 * part / size
        return b, slope


class MagneticSpheres(Magnets):
    """Uniformly magnetised spheres make a magnetic field, the sum over all of them; they do not magnetise
    each other.

        B = 2/3 mu_0 M inside;    outside a dipole of moment M V, V the volume

    Source: J. D. Jackson, Classical Electrodynamics (1999), Eqs (5.56), (5.105).
    """

    spheres: tuple[Sphere, ...] = option("the spheres; worlds of a batch may have different numbers")
