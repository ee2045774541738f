"""The contract of a source: an external field of place and time that acts on particles through other effects.

A source is an effect (see tisim/effects/base) that writes nothing. Effects that depend on a field find its
sources with ``sources`` among the bound effects of a scene, and add up their values.
"""

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option, parameter
from tisim.state.bound import Bound, Peers

__all__ = ["Source", "option", "parameter", "sources"]


class Source(Effect):
    """A source is an external field of place and time, such as the field of a magnet or a flow.

    quantity : standard name of the field, "magnetic_flux_density" (T), "electric_field" (V/m),
    "flow_velocity" (m/s).
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False
    quantity: ClassVar[str]

    def strongest(self) -> float | None:
        """Return an upper bound on the magnitude of the field, in its unit; None if none is known."""
        return None

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
        """Return the field and its gradient; sources override this to compute both from shared terms."""
        return self.value(w, r, t), self.gradient(w, r, t)

    @ti.func
    def add_tile(self, w, r: ti.template(), t, value: ti.template(), gradient: ti.template()):  # type: ignore[valid-type]
        """Add the field and its gradient at a tile of points. r and ``value`` are three vectors and
        ``gradient`` nine, with one component for each point; ``gradient`` may be empty if it is not needed.
        Sources that process a tile at once override this."""
        for lane in range(ti.static(r[0].n)):
            place = ti.Vector([r[0][lane], r[1][lane], r[2][lane]])
            one, slope = self.value_and_gradient(w, place, t)
            add_point(value, gradient, lane, one, slope)


@ti.func
def add_point(value: ti.template(), gradient: ti.template(), lane, one, slope):  # type: ignore[valid-type]
    """Add the field and its gradient at one point of a tile."""
    for a in ti.static(range(3)):
        value[a][lane] = value[a][lane] + one[a]
        for c in ti.static(range(len(gradient) // 3)):
            gradient[3 * a + c][lane] = gradient[3 * a + c][lane] + slope[a, c]


def sources(peers: Peers, quantity: str) -> tuple[Bound[Source], ...]:
    """Return the sources of a quantity among the bound effects of a scene, for ``connect``."""
    return tuple(source for source in peers.of(Source) if source.data.quantity == quantity)
