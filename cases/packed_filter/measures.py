"""Measures of a packed filter."""

from collections.abc import Sequence

import numpy as np

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import particle_balance
from tisim.errors import must
from tisim.sources import MagneticCylinders, MagneticField, PoreFlow

SIZE_CLASSES = 6
"""Classes of equal numbers of colloids by size, in each of which capture is taken as equal."""
ANGLE_CLASSES = 3
"""Classes of fibres by their angle to the field; random directions are in each with the same probability."""
LAYER_CLASSES = 3
"""Classes of equal numbers of colloids by size in which layers capture. The colloids of a single run allow no
more: their noise makes a power of the fraction that passes too large."""


def matrix_box(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corner of the box of the matrix, m."""
    low, high = scene.domain.bounds()
    assert low is not None
    assert high is not None
    return low, high


def inside(result: Result) -> np.ndarray:
    """Return which colloids have entered the filter, shape (n,)."""
    return np.asarray(result.state.get("entered_at", np.zeros(len(result.state["mass"]))) >= 0)


def captured_by(result: Result, time: float = np.inf) -> np.ndarray:
    """Return which colloids are captured, and were by a time (s), shape (n,)."""
    at = result.state["captured_at"]
    return np.asarray((at >= 0) & (at <= time))


def captured_fraction(result: Result, time: float = np.inf) -> float:
    """Return the fraction of the colloids that have entered which are captured, and were by a time (s)."""
    return float(captured_by(result, time)[inside(result)].mean())


def has_left(result: Result) -> np.ndarray:
    """Return which colloids have left through the outlet, shape (n,)."""
    return np.asarray(result.state["exited_at"] >= 0)


def penetration(result: Result, which: np.ndarray | None = None) -> float:
    """Return the fraction of the colloids, or of some of them, that are never captured: they have left, or
    are free at the end. It is 1 if none has entered."""
    count = result.state.get("capture_count", result.state["captured_by"] >= 0)
    some = count[inside(result) if which is None else inside(result) & which]
    return float((some == 0).mean()) if len(some) else 1.0


def captures_by_angle(result: Result, time: float = np.inf) -> np.ndarray:
    """Return the number of colloids that a fibre has captured by a time (s), over its mean for all fibres, by
    the angle between fibre and field, shape (ANGLE_CLASSES,).

    The first class has the fibres across the field, up to |cos| = 1/ANGLE_CLASSES, and the last one those
    along it. Images capture for their fibre. NaN for a class without fibres, or without any captures. The
    field must still be on at the end of the run, as captures of released colloids are not known.
    """
    source = next(one for one in result.scene.effects if isinstance(one, MagneticField))
    must(source.end > result.time, "magnetic_field.end", "after the end of the run", source.end)
    magnets = next(one for one in result.scene.effects if isinstance(one, MagneticCylinders)).cylinders
    field = source.constant
    centre, axis = (np.array([getattr(one, name) for one in magnets]) for name in ("centre", "direction"))
    cosine = np.abs(axis @ field) / np.linalg.norm(field)
    kind = np.minimum((ANGLE_CLASSES * cosine).astype(int), ANGLE_CLASSES - 1)
    low, high = matrix_box(result.scene)
    fibres = np.bincount(kind[((low <= centre) & (centre <= high)).all(axis=1)], minlength=ANGLE_CLASSES)
    by = result.state["captured_by"][captured_by(result, time)]
    captures = np.bincount(kind[by], minlength=ANGLE_CLASSES)
    with np.errstate(divide="ignore", invalid="ignore"):
        each: np.ndarray = captures / fibres * fibres.sum() / captures.sum()
    return each


def size_classes(radius: np.ndarray, number: int = SIZE_CLASSES) -> np.ndarray:
    """Return the class by size of each colloid, 0 for the smallest, of the same shape as ``radius`` (m).

    number : of classes.
    """
    edges = np.quantile(radius, np.linspace(0, 1, number + 1))
    return np.clip(np.searchsorted(edges, radius, side="right") - 1, 0, number - 1)


def penetration_of_layers(result: Result, layers: float, which: np.ndarray | None = None) -> float:
    """Return the fraction of the colloids, or of some of them, that would pass a number of such matrices in a
    row.

    Layers are taken to capture independently of each other, those of a class by size with the same
    probability: the mean over the classes of P^layers. Small colloids pass more often than large ones, so the
    mean of all to this power would be too small.
    """
    chosen = inside(result) if which is None else inside(result) & which
    if not chosen.any():
        return 1.0
    kind = np.full(len(chosen), -1)
    kind[chosen] = size_classes(result.state["radius"][chosen], LAYER_CLASSES)
    classes, numbers = np.unique(kind[chosen], return_counts=True)
    passing = [penetration(result, kind == one) ** layers for one in classes]
    return float(np.average(passing, weights=numbers))


def released_fraction(result: Result) -> float:
    """Return the number of releases over the number of captures."""
    return result.work["releases"] / result.work["captures"]


def missing(results: Sequence[Result]) -> int:
    """Return the largest number of colloids of a run that are neither out, captured nor free."""
    return max(abs(particle_balance(one.work, one.state).missing) for one in results)


def pore_flow(result: Result) -> PoreFlow:
    """Return the resolved flow of a run."""
    return next(one for one in result.scene.effects if isinstance(one, PoreFlow))


def superficial_velocity(result: Result) -> float:
    """Return the mean velocity of the resolved flow over the cross section of the column, m/s."""
    speed = pore_flow(result).speed
    assert speed is not None
    return speed


def pressure_drop(result: Result) -> float:
    """Return the pressure that drives the resolved flow through the matrix and the clear water around it,
    Pa."""
    flow = pore_flow(result)
    assert flow.speed is not None
    return flow.viscosity * flow.speed / flow.solve().permeability * (flow.high[2] - flow.low[2])


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantity of ``tisim cost``: the fraction that is ever captured, as paths of colloids are
    random."""
    return (Quantity("captured fraction", lambda result: 1 - penetration(result), random=True),)
