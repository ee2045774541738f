"""The velocity of a fluid around particles: uniform, or driven through a packing by a pressure gradient."""

from __future__ import annotations

import math
from typing import Literal

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.sources.base import option, parameter
from tisim.sources.switched import NO_END, Switched


class UniformFlow(Switched):
    """A fluid moves everywhere at the same velocity; drag laws use it. It rests before ``begin`` and from
    ``end`` on.

    Source: B16 section 7.2.
    """

    quantity = "flow_velocity"

    velocity: Vector = parameter("m/s", "velocity of the fluid", examples=[(1e-3, 0.0, 0.0)])
    begin: float = parameter("s", "time from which on the fluid flows", 0.0, ge=0)
    end: float = parameter("s", "time at which the flow ends", NO_END, gt=0)

    def strongest(self) -> float:
        return math.hypot(*self.velocity)

    @ti.func
    def value(self, w, r, t):
        return ti.select(self.acts(w, t), 1.0, 0.0) * self.velocity(w)


def kozeny_carman(porosity, size, constant):
    """Return the permeability k = (1 - phi)^3 nu^2 / (C phi^2) of a packing (m^2).

    porosity : 1 - phi. size : nu (m), volume over surface of the packed bodies. constant : C.

    Source: B16 Eq. (7.4), after Kozeny (1927) and Carman (1937).
    """
    return porosity**3 * size**2 / (constant * (1.0 - porosity) ** 2)


_kozeny_carman = ti.func(kozeny_carman)


class DarcyFlow(Switched):
    """A pressure gradient drives a fluid slowly through a packing; the velocity is the mean over the packing.

        U = -k/eta grad p,    k = (1 - phi)^3 nu^2 / (C phi^2)

    k is the Kozeny-Carman permeability. nu is the volume over the surface of the packed bodies: D/4 for long
    fibres and D/6 for spheres of diameter D. The mean is over the whole packing (Darcy's velocity) or over
    the pores alone, in which the fluid is faster by one over the porosity. B16 (7.3) gives the mass flow
    rate, rho_0 A U. The fluid rests before ``begin`` and from ``end`` on.

    Source: B16 Eqs (7.3), (7.4).
    """

    quantity = "flow_velocity"

    pressure_gradient: Vector = parameter(
        "Pa/m",
        "pressure gradient grad p; the fluid flows in the opposite direction",
        examples=[(-100.0, 0.0, 0.0)],
    )
    viscosity: float = parameter("Pa s", "dynamic viscosity eta of the fluid", examples=[1e-3], gt=0)
    porosity: float = parameter("", "porosity 1 - phi of the packing", examples=[0.9], gt=0, lt=1)
    diameter: float = parameter("m", "diameter D of the packed fibres or spheres", examples=[6e-4], gt=0)
    constant: float = parameter("", "constant C of Kozeny and Carman; about 5 in random packings", 5.0, gt=0)
    packed: Literal["fibres", "spheres"] = option("shape of the packed bodies", "fibres")
    mean: Literal["packing", "pores"] = option("volume over which the velocity is averaged", "packing")
    begin: float = parameter("s", "time from which on the fluid flows", 0.0, ge=0)
    end: float = parameter("s", "time at which the flow ends", NO_END, gt=0)

    def strongest(self) -> float:
        size = self.diameter / (4 if self.packed == "fibres" else 6)
        mean = kozeny_carman(self.porosity, size, self.constant) / self.viscosity
        return float(math.hypot(*self.pressure_gradient) * mean / self.porosity)

    @ti.func
    def value(self, w, r, t):
        size = self.diameter(w) / ti.static(4.0 if self.packed == "fibres" else 6.0)
        velocity = -_kozeny_carman(self.porosity(w), size, self.constant(w)) / self.viscosity(w)
        if ti.static(self.mean == "pores"):
            velocity /= self.porosity(w)
        return ti.select(self.acts(w, t), velocity, 0.0) * self.pressure_gradient(w)
