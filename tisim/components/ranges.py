"""The magnitudes that quantities may have, so that the arithmetic of the laws is valid.

A volume is the cube of a length and occurs in numerators and denominators; a moment of inertia is a mass
times the square of a length; masses are added and multiplied. Within these limits all results are normal
numbers in double precision. Other quantities may have any value except subnormal numbers, which kernels flush
to zero.
"""

from __future__ import annotations

import math

import numpy as np

from tisim.errors import Words, must

LEAST, MOST = 1e-100, 1e100
"""Limits of the magnitudes of lengths (m) and masses (kg) other than 0."""
NORMAL = float(np.finfo(np.float64).tiny), float(np.finfo(np.float64).max)
"""Limits of the magnitudes of normal numbers in double precision."""
WHOLE = 2**31
"""Bound of the integers and exponents that are compiled into kernels."""
PARTICLES = 10**8
"""Largest number of particles in an initial state."""
BYTES = 300
"""Least memory of a particle with its fields and lists, bytes."""
FINE = 1e-3
"""Largest shift of the centres of a packing by rounding, relative to a radius; the packing then stays
separated and even."""


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
    """Raise InputError unless the length of an axis, and its square, can be a divisor."""
    must(LEAST <= math.hypot(*axis) <= MOST, what, "a direction", axis)


def check_memory(what: str, number: int, bytes_each: float = BYTES) -> None:
    """Raise InputError, before allocation, unless this machine has enough memory for ``number`` objects."""
    from tisim.backend import runtime

    there = runtime.memory()
    rule = f"within the {there / 1e9:.0f} GB that this process may have"
    must(
        number * bytes_each <= there, f"memory for {what}", rule, Words(f"{number * bytes_each / 1e9:.3g} GB")
    )


def check_resolved(what: str, places: np.ndarray, radius: float) -> None:
    """Raise InputError unless the rounding error of the largest coordinate (m) is well below a radius (m).

    Farther from the origin, packed spheres would be rounded to the same position.
    """
    farthest = float(np.abs(places).max(initial=0.0))
    step = float(np.spacing(farthest))
    rule = f"so near the origin that rounding, {step:.1e} m there, is at most {FINE * radius:.1e} m"
    must(step <= FINE * radius, what, rule, farthest)
