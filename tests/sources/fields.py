"""Field and gradient of a source at many points, as computed in kernels."""

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.state.bound import connected
from tisim.state.parameter_table import ParameterTable

WORLDS = 4
_bound: dict = {}


@in_taichi_thread
@ti.kernel
def _evaluate(source: ti.template(), r: ti.types.ndarray(), out: ti.types.ndarray()):
    for w, i in ti.ndrange(r.shape[0], r.shape[1]):
        place = ti.Vector([r[w, i, 0], r[w, i, 1], r[w, i, 2]])
        b, slope = source.value_and_gradient(w, place, 0.0)
        alone, again = source.value(w, place, 0.0), source.gradient(w, place, 0.0)
        for a in ti.static(range(3)):
            out[w, i, 0, a], out[w, i, 4, a] = b[a], alone[a]
            for c in ti.static(range(3)):
                out[w, i, 1 + c, a], out[w, i, 5 + c, a] = slope[a, c], again[a, c]


def fields(sources, points):
    """B, (worlds, n, 3), and dB_a/dr_c, (worlds, n, 3, 3), of one source for each world at its points."""
    room = {name: max(one.room()[name] for one in sources) for name in sources[0].room()}
    sources = [one.with_room(room) for one in sources]
    key = (runtime.generation(), sources[0].structure())
    if key not in _bound:
        table = ParameterTable(sources[:1], WORLDS, runtime.current().real)
        _bound[key] = table, *connected([table.bind(sources[0])])
    table, source = _bound[key]
    table.write([[one] for one in sources])
    points = np.asarray(points, dtype=float)
    assert points.shape[0] == len(sources) <= WORLDS
    out = np.zeros((*points.shape[:2], 8, 3))
    _evaluate(source, points, out)
    # Field and gradient are the same if computed separately or together.
    np.testing.assert_array_equal(out[:, :, :4], out[:, :, 4:])
    return out[:, :, 0], np.swapaxes(out[:, :, 1:4], 2, 3)


def relative(values, expected):
    """Norm of the difference over the norm of the expected vector or matrix, for each point of one world."""
    axes = tuple(range(1, values.ndim))
    return np.sqrt(((values - expected) ** 2).sum(axes) / (expected**2).sum(axes))


def steepness(field, gradient, points, half):
    """Reference size for errors of a cylinder's gradient, at points of one world; axis along z, radius 1.

    In the middle of the cylinder the gradient passes through 0, but its terms do not. They are of size B over
    the distance to the rim, with the radius added across.
    """
    far = np.hypot(np.abs(np.hypot(*points.T[:2]) - 1) + 1, np.abs(points[:, 2]) - half)
    return np.linalg.norm(gradient, axis=(1, 2)) + np.linalg.norm(field, axis=1) / far
