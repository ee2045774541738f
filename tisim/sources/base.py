"""The contract of a source: an external field of place and time, which effects feel.

A source is an effect (see tisim/effects/base) that writes nothing. Whoever feels it finds it with
``sources`` among the bound effects of a scene, and adds up what they give.
"""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option, parameter
from tisim.worlds.bound import Bound, Peers

__all__ = ["Source", "option", "parameter", "sources"]


class Source(Effect):
    """A source is an external field of place and time, such as that of a magnet or a flow.

    quantity : its standard name, "magnetic_flux_density" (T), "electric_field" (V/m), "flow_velocity" (m/s).
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False
    quantity: ClassVar[str]

    @ti.func
    def value(self, w, r, t):
        """Return the field at r (m) and time t (s)."""
        return 0.0 * r

    @ti.func
    def gradient(self, w, r, t):
        """Return the gradient of the field: [a, b] the derivative of component a along axis b, per metre."""
        return r.outer_product(0.0 * r)

    @ti.func
    def value_and_gradient(self, w, r, t):
        """Return the field and its gradient; a source that makes both of the same numbers does so here."""
        return self.value(w, r, t), self.gradient(w, r, t)


def sources(peers: Peers, quantity: str) -> tuple[Bound[Source], ...]:
    """Return the sources of a quantity among the bound effects of a scene, for ``connect``."""
    return tuple(source for source in peers.of(Source) if source.data.quantity == quantity)
