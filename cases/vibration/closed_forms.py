"""Closed forms of a charged, tethered particle in uniform fields (Z13 section 3), with only NumPy.

In the plane across B, along z, with w = q B/m and the field along x, z = x + i y obeys

    z'' + i w z' + (k/m) z = (q/m) E(t),

so free motion is a sum of exp(lambda t), lambda = i (-w/2 +- sqrt(w^2/4 + k/m)). All arguments may be arrays
that broadcast; SI units.
"""

from __future__ import annotations

import numpy as np

Numbers = np.ndarray | float


def response(t: Numbers, w: Numbers, k_m: Numbers, push: Numbers, omega: Numbers) -> np.ndarray:
    """Return z = x + i y (m) from rest at the anchor, with equal tethers along x and y, in E_0 sin(Omega t)
    along x.

    The centre of gravity of a cloud moves in the same way, because forces between its particles cancel. Not
    valid at resonance.
    """
    root = np.sqrt(np.asarray(w, float) ** 2 / 4 + k_m)
    a, b = 1j * (-w / 2 + root), 1j * (-w / 2 - root)
    # E_0 sin(Omega t) = Im: the particular solution of exp(+-i Omega t) divided by D(+-Omega).
    plus = push / 2j / (k_m - omega**2 - w * omega)
    minus = push / 2j / (k_m - omega**2 + w * omega)
    # z(0) = z'(0) = 0 gives the two amplitudes of free motion.
    place, speed = plus - minus, 1j * omega * (plus + minus)
    c = (b * place - speed) / (a - b)
    d = (speed - a * place) / (a - b)
    driven_part = plus * np.exp(1j * omega * t) - minus * np.exp(-1j * omega * t)
    return driven_part + c * np.exp(a * t) + d * np.exp(b * t)


def resonances(w: float, k_m: float) -> tuple[float, float]:
    """Return the two angular frequencies (1/s) at which ``response`` grows without bound."""
    root = np.sqrt(w**2 / 4 + k_m)
    return float(root - abs(w) / 2), float(root + abs(w) / 2)
