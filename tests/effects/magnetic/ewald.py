"""The Ewald sum of dipoles in NumPy, and plain sums over images."""

import math

import numpy as np
from scipy.special import erfc

from tests.effects.magnetic.magnets import MU_0
from tisim.effects.magnetic.ewald_accuracy import periods


class EwaldSum:
    """Energy, field and force of dipoles in a box, by the equations of an effect, given its alpha and k_max.

    Wave vectors are summed one by one, over all of k-space; pairs over nearest images.
    """

    def __init__(self, law, domain, position, moment):
        law = law.at_start(np.empty(0))
        self.alpha, self.cutoff, self.k_max = law.screening, law.cutoff, law.wave_cutoff
        joined = np.array(domain.imaged())
        self.side = periods(domain, law.slab_factor)
        self.factors = np.array(law.demagnetising_factors) + ~joined
        self.volume, self.r, self.m = self.side.prod(), position, moment
        d = position[None] - position[:, None]
        d -= np.where(joined, self.side * np.round(d / self.side), 0)
        distance = np.linalg.norm(d, axis=2)
        self.near = (distance <= self.cutoff) & ~np.eye(len(position), dtype=bool)
        self.distance = np.where(self.near, distance, 1.0)
        self.n = d / self.distance[..., None]
        most = np.ceil(self.k_max * self.side / (2 * math.pi)).astype(int)
        n = np.stack(np.meshgrid(*(np.arange(-a, a + 1) for a in most), indexing="ij"), -1).reshape(-1, 3)
        k = 2 * math.pi * n / self.side
        square = (k**2).sum(axis=1)
        keep = (square > 0) & (square <= self.k_max**2)
        self.k, self.g = k[keep], np.exp(-square[keep] / (4 * self.alpha**2)) / square[keep]
        self.turn = np.exp(1j * self.k @ position.T)
        self.along = self.k @ moment.T

    def factors_of_pairs(self):
        x = self.alpha * self.distance
        gauss = np.exp(-x * x) / math.sqrt(math.pi)
        b = erfc(x) + 2 * x * gauss
        c = 3 * b + 4 * x**3 * gauss
        d = 5 * c + 8 * x**5 * gauss
        return tuple(MU_0 / (4 * math.pi) * np.where(self.near, one, 0.0) for one in (b, c, d))

    def field(self):
        """Field at each particle, T."""
        b, c, _ = self.factors_of_pairs()
        along = np.einsum("ijk,jk->ij", self.n, self.m)
        cube = self.distance**3
        near = np.einsum("ij,ijk->ik", c / cube * along, self.n) - (b / cube) @ self.m
        s = (self.along * self.turn).sum(axis=1)
        waves = -MU_0 / self.volume * ((self.turn.conj() * (self.g * s)[:, None]).real.T @ self.k)
        own = MU_0 * self.alpha**3 / (3 * math.pi**1.5) * self.m
        return near + waves + own - MU_0 / self.volume * self.factors * self.m.sum(axis=0)

    def energy(self):
        """Energy, J."""
        return -0.5 * (self.m * self.field()).sum()

    def force(self):
        """Force on each particle, N."""
        _, c, d = self.factors_of_pairs()
        along = np.einsum("ijk,jk->ij", self.n, self.m)
        own = np.einsum("ijk,ik->ij", self.n, self.m)
        fourth = self.distance**4
        near = np.einsum("ij,ijk->ik", (d * own * along - c * (self.m @ self.m.T)) / fourth, self.n)
        near -= (c * own / fourth) @ self.m + (c * along / fourth).sum(axis=1)[:, None] * self.m
        s = (self.along * self.turn).sum(axis=1)
        phase = (self.turn * s.conj()[:, None]).imag * self.along * self.g[:, None]
        return near + MU_0 / self.volume * (phase.T @ self.k)


def ball_of_images(side, position, moment, radius):
    """Field (T) and force (N) of dipoles with all images of a cubic box in cells within a radius
    (in sides)."""
    field, force = np.zeros_like(position), np.zeros_like(position)
    most = int(radius)
    for shift in np.ndindex((2 * most + 1,) * 3):
        cell = np.array(shift) - most
        if (cell**2).sum() > radius**2:
            continue
        d = position[None] + side * cell - position[:, None]
        distance = np.linalg.norm(d, axis=2)
        itself = distance == 0
        distance[itself] = np.inf
        n = d / np.where(itself, 1.0, distance)[..., None]
        a, b = np.einsum("ijk,ik->ij", n, moment), np.einsum("ijk,jk->ij", n, moment)
        scale = MU_0 / (4 * math.pi) / distance**3
        field += np.einsum("ij,ijk->ik", 3 * scale * b, n) - scale @ moment
        scale = 3 * scale / distance
        force += np.einsum("ij,ijk->ik", scale * (5 * a * b - moment @ moment.T), n)
        force -= (scale * a) @ moment + (scale * b).sum(axis=1)[:, None] * moment
    return field, force
