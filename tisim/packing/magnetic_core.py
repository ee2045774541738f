"""The magnetic core of a grain: moments that follow from the grain's own radius (B16 Eq. 7.6)."""

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component, parameter
from tisim.numerics import elementary, philox
from tisim.numerics.random_streams import CORE_MOMENTS

CORE_QUANTITIES = ("domain_moment", "saturation_moment")
"""Quantities that a core may give, in A m^2."""


class MagneticCore(Component):
    """A grain has a ball of magnetic material in a shell that is not magnetic; its moments follow from its
    own radius R.

        m_s = M_s 4/3 pi (R - shell)^3 ratio^Z,    mu_d = min(m_s, M_s 4/3 pi domain^3)

    m_s is the ``saturation_moment`` of the grain, 0 if it is no larger than its shell. Z is a standard normal
    number, independent for each grain: moments of grains of one size are lognormal, with M_s times the volume
    as median. mu_d is the ``domain_moment``, given only if ``domain`` is; otherwise the core is one domain,
    mu_d = m_s. R - shell is the magnetic radius of B16, and R the hydrodynamic one.

    Source: B16 Eq. (7.6).
    """

    magnetisation: float = parameter(
        "A/m", "saturation magnetisation M_s of the core", examples=[4.46e5], ge=0
    )
    shell: float = parameter("m", "thickness of the shell that is not magnetic", 0.0, ge=0)
    ratio: float = parameter(
        "",
        "geometric standard deviation of the moments of grains of one size; 1 for equal moments",
        1.0,
        ge=1,
    )
    domain: float | None = parameter(
        "m", "radius of a magnetic domain in the core; the whole core unless given", None, gt=0
    )

    def names(self) -> tuple[str, ...]:
        """Return the names of the quantities that it gives."""
        return CORE_QUANTITIES if self.domain is not None else CORE_QUANTITIES[1:]

    def moments(self, radius: np.ndarray, normal: np.ndarray) -> dict[str, np.ndarray]:
        """Return the quantities (A m^2) of grains of these radii (m), given a normal number Z for each;
        shape (n,)."""
        volume = 4 / 3 * np.pi * np.maximum(radius - self.shell, 0.0) ** 3
        saturation = self.magnetisation * volume * self.ratio**normal
        if self.domain is None:
            return {"saturation_moment": saturation}
        largest = self.magnetisation * 4 / 3 * np.pi * self.domain**3
        return {"domain_moment": np.minimum(saturation, largest), "saturation_moment": saturation}

    def row(self) -> list[float]:
        """Return the numbers that ``core_moments`` needs: M_s, shell, ln ratio, and the largest domain
        moment."""
        largest = np.inf if self.domain is None else self.magnetisation * 4 / 3 * np.pi * self.domain**3
        return [self.magnetisation, self.shell, float(np.log(self.ratio)), float(largest)]


@ti.func
def core_moments(row: ti.template(), c, radius, normal):  # type: ignore[valid-type]
    """Return saturation moment and domain moment (A m^2, f64) of a grain with the core in row c of a table,
    given its radius (m) and Z, as ``MagneticCore.moments`` does."""
    inner = ti.max(ti.cast(radius, ti.f64) - row[c, 1], 0.0)
    spread = elementary.exp(row[c, 2] * normal)
    saturation = row[c, 0] * (4.0 / 3.0 * ti.math.pi) * inner * inner * inner * spread
    return saturation, ti.min(saturation, row[c, 3])


@ti.func
def core_normal(seed, number, index):
    """Return the normal number Z of a grain that is inserted, by its number in the insertion of an index."""
    return philox.normal(philox.bits(seed, CORE_MOMENTS, number, index))[0]


def core_normals(number: int, seed: int) -> np.ndarray:
    """Return the normal number Z of each grain of an initial state, shape (number,). For a larger number, the
    first ones are the same."""
    return np.random.Generator(np.random.Philox(key=[seed, CORE_MOMENTS])).normal(size=number)
