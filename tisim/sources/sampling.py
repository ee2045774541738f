"""The field of sources at given points, as it acts on particles of a scene."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tisim.backend import runtime
from tisim.backend.memory import collected
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects.base import Effect
from tisim.errors import must
from tisim.sources.base import Source
from tisim.state.bound import Peers, connected
from tisim.state.parameter_table import ParameterTable

TILE_POINTS = 16
"""Number of points evaluated together on a CPU."""


def tile_size() -> int:
    """Return the number of points evaluated together."""
    return TILE_POINTS if runtime.current().device == "cpu" else 1


@ti.data_oriented
class _Sum:
    """The sum of bound sources."""

    def __init__(self, fields: Peers) -> None:
        self.fields = fields

    @ti.kernel
    def at(self, t: ti.f64, r: ti.types.ndarray(), out: ti.types.ndarray()):  # type: ignore[valid-type]
        points = r.shape[0]
        tile = ti.static(tile_size())
        for first in range((points + tile - 1) // tile):
            place = [ti.Vector([0.0] * tile) for _ in ti.static(range(3))]
            value = [ti.Vector([0.0] * tile) for _ in ti.static(range(3))]
            gradient = [ti.Vector([0.0] * tile) for _ in ti.static(range(9))]
            for lane in range(tile):
                for a in ti.static(range(3)):
                    place[a][lane] = r[ti.min(first * tile + lane, points - 1), a]
            for field in ti.static(self.fields):
                field.add_tile(0, place, t, value, gradient)
            for lane in range(ti.min(tile, points - first * tile)):
                for a in ti.static(range(3)):
                    out[first * tile + lane, 0, a] = value[a][lane]
                    for c in ti.static(range(3)):
                        out[first * tile + lane, 1 + c, a] = gradient[3 * a + c][lane]


class FieldSampler:
    """The sum of all sources of a quantity among effects at any points, compiled once for many calls.

    It is a context manager: after ``with FieldSampler(effects, "flow_velocity") as flow`` call
    ``flow(points)`` as often as wanted. At the end of the block the memory of the device is freed.

    quantity : its standard name, such as "magnetic_flux_density" (T). InputError is raised if it has no
    source.
    """

    def __init__(self, effects: Sequence[Effect], quantity: str) -> None:
        self.real = runtime.current().real
        sources = [effect for effect in effects if isinstance(effect, Source) and effect.quantity == quantity]
        must(bool(sources), "effects", f"with a source of {quantity}", [effect.label for effect in effects])
        self._bind(sources)

    @in_taichi_thread
    def _bind(self, sources: Sequence[Source]) -> None:
        with collected() as self.trees:
            table = ParameterTable(sources, 1, self.real)
            bound = connected([table.bind(source) for source in sources])
            table.write([sources])
            self.sum = _Sum(bound)

    def __call__(self, points: ArrayLike, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Return the field, shape (n, 3), and its gradient, shape (n, 3, 3), at points (m, shape (n, 3)) and
        a time (s); see ``sample``."""
        places = np.ascontiguousarray(points, np.float64 if self.real == ti.f64 else np.float32)
        must(places.ndim == 2 and places.shape[1] == 3, "points", "of shape (n, 3)", places.shape)
        out = np.zeros((len(places), 4, 3), places.dtype)
        self._at(time, places, out)
        return out[:, 0].astype(float), np.swapaxes(out[:, 1:], 1, 2).astype(float)

    @in_taichi_thread
    def _at(self, time: float, places: np.ndarray, out: np.ndarray) -> None:
        self.sum.at(time, places, out)

    def __enter__(self) -> Self:
        return self

    @in_taichi_thread
    def __exit__(self, *failure: object) -> None:
        for tree in self.trees:
            tree.destroy()


def sample(
    effects: Sequence[Effect], quantity: str, points: ArrayLike, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the sum of all sources of a quantity among effects, shape (n, 3), and its gradient, (n, 3, 3).

    quantity : its standard name, such as "magnetic_flux_density" (T). points : m, shape (n, 3). time : s.
    [k, a, b] of the gradient is the derivative of component a along axis b, per metre. Each call compiles a
    kernel; use ``FieldSampler`` to call it more often.
    InputError is raised if the quantity has no source, or for points of another shape.
    """
    with FieldSampler(effects, quantity) as field:
        return field(points, time)
