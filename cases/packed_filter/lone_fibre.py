"""Capture in a matrix as it follows from single fibres, without their neighbours.

A fibre alone, in a random direction, is run with the colloids, the field and the flow of a filter. In water
at rest it has captured those from a volume V(t) by the time t; in a stream those from an area A of it. If the
fibres of a matrix captured independently of each other, a colloid would find none in n V or n A depth
expected fibres, n per volume, with the probability

    static: exp(-n V(t)),    dynamic: exp(-n A depth)

In the cascade of B16 6.4.5 the colloids pass one fibre after the other, and begin anew at random in the
volume 1/n around each. Each stage takes the time in which the flow passes the distance n^(-1/3) of fibres:

    cascade: (1 - n V(stage))^(depth n^(1/3)),    stage = n^(-1/3) / u

Each is computed for the colloids of a size and averaged over the sizes.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tisim import Box, run
from tisim.analysis import Mean
from tisim.cases.common.runs import sound
from tisim.cases.packed_filter.matrix import magnetised
from tisim.cases.packed_filter.measures import SIZE_CLASSES, size_classes
from tisim.cases.packed_filter.scene import PackedFilter
from tisim.engine.batches import Progress
from tisim.sources import Cylinder
from tisim.sources.switched import NO_END

START_MARGIN = 5.0
"""Distance from the fibre within which colloids start, D. Fibres attract them from less than that."""
COMPARED_RESOLUTION = 5.0
"""Cells over D of the flow where a matrix is compared with lone fibres, and where many are compared."""


@dataclass(frozen=True)
class LoneFibre:
    """Captures by lone fibres in many random directions.

    filter : their settings. size : measure of the space in which colloids start around a fibre: its volume
    (m^3) or the area across the flow (m^2). radius : of the colloids (m), shape (fibres, number).
    captured_at : s, -1 for never, of the same shape.
    """

    filter: PackedFilter
    size: np.ndarray
    radius: np.ndarray
    captured_at: np.ndarray

    def passed(self, time: float, fibres: float, stages: float = 1.0) -> Mean:
        """Return the fraction of colloids that are not captured.

        time : from the start of the run, s. fibres : per volume (1/m^3), or per area (1/m^2), that a colloid
        meets in each of a number of stages; 1 for exp(-n V), more for (1 - n V)^stages.
        """
        kind = size_classes(self.radius)
        caught = (self.captured_at >= 0) & (self.captured_at <= time)
        size = self.size[:, None]
        # The jackknife over fibres gives the interval of a mean that is no linear function of them.
        whole = range(len(self.size))
        left = [self._passed(kind[rest], (caught * size)[rest], fibres, stages) for rest in _without(whole)]
        mean = self._passed(kind, caught * size, fibres, stages)
        pseudo = len(whole) * mean - (len(whole) - 1) * np.array(left)
        return Mean.of(pseudo)

    @staticmethod
    def _passed(kind: np.ndarray, volume: np.ndarray, fibres: float, stages: float) -> float:
        captured = np.array([volume[kind == k].mean() for k in range(SIZE_CLASSES)])
        expected = fibres * captured
        survive = np.exp(-expected) if stages == 1.0 else np.maximum(1 - expected, 0.0) ** stages
        return float(survive.mean())


def _without(whole: range) -> list[np.ndarray]:
    """Return the indices without each of them in turn."""
    return [np.delete(np.arange(len(whole)), k) for k in whole]


def lone_fibres(
    filter: PackedFilter, fibres: int, seed: int = 0, progress: Progress | None = None
) -> LoneFibre:
    """Run lone fibres in random directions with the settings of a filter; RunError if a run fails.

    The flow around a lone fibre has the resolution of the filter. If a matrix is to be compared with it, its
    flow needs the same: a coarse flow brings too many colloids to fibres.
    """
    axes = Rotation.random(fibres, rng=np.random.default_rng([seed, 0x10E])).apply([0.0, 0.0, 1.0])
    matrix = filter.matrix
    # One box for all directions, so that all are worlds of one batch.
    half = START_MARGIN * matrix.diameter + 0.5 * (matrix.length + matrix.diameter)
    box = Box(
        low=(-half, -half, -half), high=(half, half, half), periodic=(False, False, False), images=False
    )
    own = np.pi / 4 * matrix.diameter**2 * matrix.length
    size = 8 * half**3 - own if filter.mode == "static" else 4 * half**2
    # The field remains on, as a released colloid would count as one that was never captured.
    lasting = replace(filter, adhering=None, field_end=NO_END)
    scenes = []
    for k, axis in enumerate(axes):
        body = Cylinder(axis=tuple(axis.tolist()), radius=matrix.diameter / 2, length=matrix.length)
        scenes.append(
            lasting.scene_about((body,), (magnetised(body, filter.field(), filter.saturated),), box, seed + k)
        )
    results = sound(run(scenes, progress))
    radius, at = (np.array([result.state[name] for result in results]) for name in ("radius", "captured_at"))
    return LoneFibre(filter, np.full(fibres, size), radius, at)
