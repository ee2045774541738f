"""The field of sources at any points, as particles of a scene would feel it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tisim.backend import runtime
from tisim.backend.memory import collected
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects.base import Effect
from tisim.errors import must
from tisim.sources.base import Source
from tisim.worlds.bound import Peers, connected
from tisim.worlds.parameter_table import ParameterTable


@ti.data_oriented
class _Sum:
    """This is the sum of bound sources."""

    def __init__(self, fields: Peers) -> None:
        self.fields = fields

    @ti.kernel
    def at(self, t: ti.f64, r: ti.types.ndarray(), out: ti.types.ndarray()):  # type: ignore[valid-type]
        for i in range(r.shape[0]):
            place = ti.Vector([r[i, 0], r[i, 1], r[i, 2]])
            value, gradient = 0.0 * place, 0.0 * place.outer_product(place)
            for field in ti.static(self.fields):
                b, slope = field.value_and_gradient(0, place, t)
                value += b
                gradient += slope
            for a in ti.static(range(3)):
                out[i, 0, a] = value[a]
                for c in ti.static(range(3)):
                    out[i, 1 + c, a] = gradient[a, c]


def sample(
    effects: Sequence[Effect], quantity: str, points: ArrayLike, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the sum of all sources of a quantity among effects, shape (n, 3), and its gradient, (n, 3, 3).

    quantity : its standard name, such as "magnetic_flux_density" (T). points : m, shape (n, 3). time : s.
    [k, a, b] of the gradient is the derivative of component a along axis b, per metre.
    InputError is raised where there is no source of it, or for points of another shape.
    """
    real = runtime.current().real
    places = np.ascontiguousarray(points, np.float64 if real == ti.f64 else np.float32)
    must(places.ndim == 2 and places.shape[1] == 3, "points", "of shape (n, 3)", places.shape)
    sources = [effect for effect in effects if isinstance(effect, Source) and effect.quantity == quantity]
    must(bool(sources), "effects", f"with a source of {quantity}", [effect.label for effect in effects])
    out = np.zeros((len(places), 4, 3), places.dtype)
    _sample(sources, real, time, places, out)
    return out[:, 0].astype(float), np.swapaxes(out[:, 1:], 1, 2).astype(float)


@in_taichi_thread
def _sample(sources: Sequence[Source], real: Any, time: float, places: np.ndarray, out: np.ndarray) -> None:
    with collected() as trees:
        table = ParameterTable(sources, 1, real)
        bound = connected([table.bind(source) for source in sources])
        table.write([sources])
        _Sum(bound).at(time, places, out)
    for tree in trees:
        tree.destroy()
