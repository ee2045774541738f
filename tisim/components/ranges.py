"""The magnitudes that quantities may have, so that the arithmetic of the laws holds.

A volume is the cube of a length, and stands above and below the line; a moment of inertia is a mass times the
square of a length; masses are added up and multiplied. Within these limits all of them are normal numbers of
double precision. Other quantities may be anything but subnormal: kernels flush such numbers to zero.
"""

from __future__ import annotations

import math

import numpy as np

from tisim.errors import Words, must

LEAST, MOST = 1e-100, 1e100
"""Lengths (m) and masses (kg) that are not 0 have magnitudes between these."""
NORMAL = float(np.finfo(np.float64).tiny), float(np.finfo(np.float64).max)
"""The normal numbers of double precision have magnitudes between these."""
WHOLE = 2**31
"""This bounds the whole numbers and exponents that are compiled into kernels."""
PARTICLES = 10**8
"""A start can have this many particles at most."""
BYTES = 300
"""A particle takes at least this much memory, in bytes, with its fields and lists."""
FINE = 1e-3
"""Rounding may shift the centres of a packing by this part of a radius: they are then apart and even."""


def limits(unit: str) -> tuple[float, float]:
    """Return the least and the largest magnitude of a quantity of this unit that is not 0."""
    return (LEAST, MOST) if unit in ("m", "kg") else NORMAL


def check_magnitude(what: str, unit: str, value: float | tuple[float, ...]) -> None:
    """Raise InputError unless a quantity, or its largest component, is 0 or within the limits of its unit."""
    least, most = limits(unit)
    size = max(map(abs, value)) if isinstance(value, tuple) else abs(value)
    rule = f"0, or of a magnitude of {least:.4g} to {most:.4g} {unit}".rstrip()
    must(size == 0 or least <= size <= most, what, rule, value)


def check_direction(what: str, axis: tuple[float, float, float]) -> None:
    """Raise InputError unless the length of an axis can be divided by, as its square can."""
    must(LEAST <= math.hypot(*axis) <= MOST, what, "a direction", axis)


def check_memory(what: str, number: int, bytes_each: float = BYTES) -> None:
    """Raise InputError, before any is allocated, unless this machine has memory for a number of things."""
    from tisim.backend import runtime

    there = runtime.memory()
    rule = f"within the {there / 1e9:.0f} GB that this process may have"
    must(
        number * bytes_each <= there, f"memory for {what}", rule, Words(f"{number * bytes_each / 1e9:.3g} GB")
    )


def check_resolved(what: str, places: np.ndarray, radius: float) -> None:
    """Raise InputError unless rounding of the largest coordinate (m) is well below a radius (m). Further from
    the origin, spheres that are packed would lie in one place.
    """
    farthest = float(np.abs(places).max(initial=0.0))
    step = float(np.spacing(farthest))
    rule = f"so near the origin that rounding, {step:.1e} m there, is at most {FINE * radius:.1e} m"
    must(step <= FINE * radius, what, rule, farthest)
