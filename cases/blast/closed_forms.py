"""Closed forms of one particle of a blast (Z16): with drag, with drag and fields of equal force, and at rest.

A particle starts with the speed v_0 in a fluid at rest. Its drag has a constant coefficient (sections 4 and
5), or is Chow's (4.2) or Stokes's (appendix A). Arguments may be arrays that broadcast; SI units.
"""

import numpy as np

Numbers = np.ndarray | float


def drag_rate(coefficient: Numbers, air: Numbers, density: Numbers, radius: Numbers) -> Numbers:
    """Return K = 3 C_D rho_a/(8 rho R), 1/m (Z16 4.3): a particle loses speed at the rate K v^2.

    coefficient : C_D. air, density : of the fluid and of the particle, kg/m^3. radius : m.
    """
    return 3 * coefficient * air / (8 * density * radius)


def speed_at(distance: Numbers, speed: Numbers, rate: Numbers) -> np.ndarray:
    """Return the speed after a distance (m), v_0 exp(-K distance), m/s (Z16 4.7). rate : K, 1/m."""
    return speed * np.exp(-np.asarray(rate) * distance)


def distance_at(slowed: Numbers, speed: Numbers, rate: Numbers) -> np.ndarray:
    """Return the distance after which the speed is ``slowed`` (m/s), -ln(v/v_0)/K, m (Z16 4.8)."""
    return -np.log(np.asarray(slowed) / speed) / rate


def distance_after(time: Numbers, speed: Numbers, rate: Numbers) -> np.ndarray:
    """Return the distance after a time (s), ln(K v_0 t + 1)/K, m (Z16 4.11). It grows for ever."""
    return np.log1p(np.asarray(rate) * speed * time) / rate


def time_to(distance: Numbers, speed: Numbers, rate: Numbers) -> np.ndarray:
    """Return the time to a distance (m), (exp(K distance) - 1)/(K v_0), s (Z16 4.12)."""
    return np.expm1(np.asarray(rate) * distance) / (rate * np.asarray(speed))


def chow_distance(
    speed: Numbers, air: Numbers, viscosity: Numbers, density: Numbers, radius: Numbers
) -> np.ndarray:
    """Return the distance to rest with Chow's drag, m, from a Reynolds number Re of 400 to 3e5.

        ln(Re/400)/K(0.5) + (400^0.646 - 1)/(0.646 K(24)) + 1/K(24)

    The terms are the distances at a coefficient of 0.5, of 24/Re^0.646 from 400 to 1, and of 24/Re from 1
    on. K(C_D) is ``drag_rate``.

    Source: Z16 4.2 for the coefficients; the distance follows from them with (4.5).
    """
    reynolds = 2 * radius * air * np.asarray(speed) / viscosity
    fast, slow = (drag_rate(c, air, density, radius) for c in (0.5, 24.0))
    return np.log(reynolds / 400) / fast + (400**0.646 - 1) / (0.646 * slow) + 1 / slow


def stokes_to_quadratic(
    viscosity: Numbers, air: Numbers, coefficient: Numbers, radius: Numbers, speed: Numbers
) -> Numbers:
    """Return Stokes drag over drag of a constant coefficient, 12 mu/(rho_a C_D R v) (Z16 4.14)."""
    return 12 * viscosity / (air * coefficient * radius * speed)


def parity_field(rate: Numbers, speed: Numbers, specific_charge: Numbers) -> Numbers:
    """Return the electric field whose force equals the drag, N/C (Z16 5.7).

        E = 3 C_D rho_a v^2/(8 |q| rho R) = K v^2/|q|

    rate : K, 1/m. specific_charge : q, C/kg.
    """
    return rate * np.square(speed) / np.abs(specific_charge)


def parity_flux(rate: Numbers, speed: Numbers, specific_charge: Numbers) -> Numbers:
    """Return the flux density across the velocity whose force equals the drag, T (Z16 5.8).

        B = 3 C_D rho_a v/(8 |q| rho R) = K v/|q|

    rate : K, 1/m. specific_charge : q, C/kg.
    """
    return rate * np.asarray(speed) / np.abs(specific_charge)


def relaxation_time(viscosity: Numbers, density: Numbers, radius: Numbers) -> Numbers:
    """Return the time tau = m/c = 2 rho R^2/(9 mu) in which Stokes drag takes 1 - 1/e of the speed, s (Z16
    A.4)."""
    return 2 * density * radius**2 / (9 * viscosity)


def viscosity_for(tau: Numbers, density: Numbers, radius: Numbers) -> Numbers:
    """Return the viscosity 2 rho R^2/(9 tau) of a relaxation time (s), Pa s (Z16 A.4)."""
    return relaxation_time(tau, density, radius)


def final_radius(speed: Numbers, tau: Numbers) -> Numbers:
    """Return the distance to rest with Stokes drag, v_0 tau, m (Z16 A.12)."""
    return speed * tau


def time_to_radius(radius: Numbers, speed: Numbers, tau: Numbers) -> np.ndarray:
    """Return the time to a distance R* with Stokes drag, -tau ln(1 - R*/R(inf)), s (Z16 A.14)."""
    return -tau * np.log1p(-np.asarray(radius) / final_radius(speed, tau))


def displacement(time: Numbers, speed: Numbers, tau: Numbers = np.inf, w: Numbers = 0.0) -> np.ndarray:
    """Return the displacement across B with Stokes drag, a complex number, m.

        d = v_0 tau (1 - exp(-(1/tau + i w) t))/(1 + i w tau)

    The velocity at the start is along the real axis. B points at the viewer, so that a positive charge turns
    clockwise, w = q B/m. At rest, |d| = v_0 tau/sqrt(1 + (w tau)^2), turned by atan(w tau). With w = 0, d is
    the displacement along B (Z16 A.11); with an infinite tau, the chord of a circle (Z16 2.8).
    """
    rate = 1 / np.asarray(tau) + 1j * np.asarray(w)
    slowed = rate * np.asarray(time, float)
    small = np.abs(slowed) < 1e-12
    mean = -np.expm1(-slowed) / np.where(small, 1.0, slowed)  # of exp(-slowed) over the time
    return np.asarray(speed * np.asarray(time) * np.where(small, 1.0, mean))
