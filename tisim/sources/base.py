"""The contract of a source: an external field of place and time, which effects feel.

A source is an effect (see tisim/effects/base.py) that writes nothing. Whoever feels it finds it with
``sources`` among the bound effects of a scene, and adds up what they give.
"""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, parameter

__all__ = ["Source", "parameter", "sources"]


class Source(Effect):
    """An external field of place and time, such as that of a magnet or a flow.

    quantity : its standard name: "magnetic_flux_density" (T), "electric_field" (V/m), "flow_velocity" (m/s).
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    quantity: ClassVar[str]

    @ti.func
    def value(self, w, r, t):
        """The field at r (m) and time t (s)."""
        return 0.0 * r

    @ti.func
    def gradient(self, w, r, t):
        """Its gradient, [a, b] the derivative of component a along axis b; per metre."""
        return r.outer_product(0.0 * r)

    @ti.func
    def value_and_gradient(self, w, r, t):
        """Both, for who needs both: a source that makes them of the same numbers does so once."""
        return self.value(w, r, t), self.gradient(w, r, t)


def sources(peers: tuple[Any, ...], quantity: str) -> tuple[Any, ...]:
    """The sources of a quantity among the bound effects of a scene, for ``connect``."""
    return tuple(peer for peer in peers if isinstance(peer, Source) and peer.quantity == quantity)
