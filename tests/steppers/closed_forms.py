"""Closed forms of one particle: a charge in uniform fields (Z13 section 3), drag in a fluid at rest (Z16).

The field is along x and B along z, w = q B/m. A tether along x only turns the angular frequency w into
gamma = sqrt(w^2 + k/m). All arguments may be arrays that broadcast; SI units.
"""

from __future__ import annotations

import numpy as np

Numbers = np.ndarray | float
Pair = tuple[np.ndarray, np.ndarray]


def static_field(t: Numbers, w: Numbers, drift: Numbers) -> Pair:
    """Velocity (m/s) along x and y, from rest in E along x, B along z; drift = E/B (Z13 9)."""
    return drift * np.sin(w * t), drift * (np.cos(w * t) - 1.0)


def tethered(t: Numbers, w: Numbers, k_m: Numbers, push: Numbers) -> Pair:
    """The same with a tether along x, k_m = k/m (1/s^2) and push = q E/m (m/s^2) (Z13 14)."""
    gamma = np.sqrt(w**2 + k_m)
    return push / gamma * np.sin(gamma * t), w * push / gamma**2 * (np.cos(gamma * t) - 1.0)


def driven(t: Numbers, w: Numbers, k_m: Numbers, push: Numbers, omega: Numbers) -> Pair:
    """The same in E_0 sin(Omega t), push = q E_0/m; also at resonance, Omega = gamma (Z13 16-18).

    With d = (gamma - Omega)/2: v_1 = push Omega t sin((Omega + gamma) t/2) sinc(d t)/(gamma + Omega), which
    grows as t at resonance, and v_2 = -w r_1.
    """
    t, w, k_m, push, omega = np.broadcast_arrays(*(np.asarray(a, float) for a in (t, w, k_m, push, omega)))
    gamma = np.sqrt(w**2 + k_m)
    mean, half = (gamma + omega) / 2, (gamma - omega) / 2
    beat = t * np.sinc(half * t / np.pi)
    v1 = push * omega * np.sin(mean * t) * beat / (2 * mean)
    # r_1 = push Omega (sin(Omega t)/Omega - sin(gamma t)/gamma)/(gamma^2 - Omega^2), without a difference of
    # nearly equal numbers: sin(Omega t)/Omega - sin(gamma t)/gamma
    #   = [half (sin(Omega t) + sin(gamma t)) + mean (sin(Omega t) - sin(gamma t))]/(Omega gamma).
    sums = np.sin(mean * t) * np.cos(half * t) - mean * np.cos(mean * t) * beat
    r1 = push * sums / (gamma * 2 * mean)
    return v1, -w * r1


def quadratic_drag(t: Numbers, speed: Numbers, rate: Numbers) -> np.ndarray:
    """Distance (m) from v_0, constant C_D: ln(K v_0 t + 1)/K, K = 3 C_D rho_a/(8 rho R) (Z16 4.11)."""
    return np.log1p(np.asarray(rate * speed) * t) / rate


def stokes_drag(t: Numbers, speed: Numbers, rate: Numbers) -> np.ndarray:
    """Distance (m) from v_0: v_0 (1 - exp(-t rate))/rate, rate = 9 mu/(2 rho R^2) (Z16 A.11)."""
    return -np.asarray(speed) * np.expm1(-np.asarray(rate) * t) / rate
