"""Six schemes of Langevin dynamics with one force evaluation a step: their exact errors in linear forces.

    python tests/benchmarks/langevin.py     prints the table of docs/steppers.md

In linear forces a scheme is a linear map of the state and the normal numbers of a step. Its stationary
variance solves a Lyapunov equation, and the diffusion and the drift of a free particle are sums of geometric
series, so that nothing is sampled. Units: m = kT = 1, and a step of 1; ``friction`` is a = gamma dt/m.
"""

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

FRICTIONS = (0.1, 1.0, 10.0)
STIFFNESS = 0.5
"""(omega dt)^2 of the trap: 0.35 of the critical step."""


def ornstein_uhlenbeck(v, g, a, time=1.0):
    """Friction and noise alone, for a part of a step."""
    return np.exp(-a * time) * v + np.sqrt(-np.expm1(-2 * a * time)) * g


def langevin(z, g, a, force):
    """The stepper of tisim: BAOAB with b dt in place of dt."""
    b = np.sqrt(np.tanh(a / 2) / (a / 2))
    x, v = z
    v = v + b / 2 * force(x)
    x = x + b / 2 * v
    v = ornstein_uhlenbeck(v, g[0], a)
    x = x + b / 2 * v
    return np.array([x, v + b / 2 * force(x)])


def baoab(z, g, a, force):
    """Leimkuhler and Matthews (2013)."""
    x, v = z
    v = v + force(x) / 2
    x = x + v / 2
    v = ornstein_uhlenbeck(v, g[0], a)
    x = x + v / 2
    return np.array([x, v + force(x) / 2])


def obabo(z, g, a, force):
    """Bussi and Parrinello (2007): friction and noise around a step of Verlet."""
    x, v = z
    v = ornstein_uhlenbeck(v, g[0], a, 0.5) + force(x) / 2
    x = x + v
    return np.array([x, ornstein_uhlenbeck(v + force(x) / 2, g[1], a, 0.5)])


def gjf(z, g, a, force):
    """Groenbech-Jensen and Farago (2013)."""
    x, v = z
    b, noise, old = 1 / (1 + a / 2), np.sqrt(2 * a) * g[0], force(x)
    x = x + b * (v + old / 2 + noise / 2)
    return np.array([x, (1 - a / 2) * b * (v + old / 2) + force(x) / 2 + b * noise])


def between_kicks(z, g, a, force):
    """Exact motion of a free particle between kicks (R. D. Skeel, J. A. Izaguirre 2002)."""
    x, v = z
    c, way = np.exp(-a), -np.expm1(-a) / a
    v = v + force(x) / 2
    # The noises of velocity and position are correlated.
    covariance = np.array([[1 - c**2, a * way**2], [a * way**2, (2 * (1 - way) - a * way**2) / a]])
    kick, shift = np.linalg.cholesky(covariance) @ g
    x, v = x + way * v + shift, c * v + kick
    return np.array([x, v + force(x) / 2])


def forces_in_verlet(z, g, a, force):
    """Friction and noise as forces of a step of Verlet, as ``fix langevin`` of LAMMPS adds them."""
    x, v, thermal = z
    v = v + (force(x) + thermal) / 2
    x = x + v
    thermal = -a * v + np.sqrt(2 * a) * g[0]
    return np.array([x, v + (force(x) + thermal) / 2, thermal])


SCHEMES = {
    "BAOAB with b dt": (langevin, 2),
    "BAOAB": (baoab, 2),
    "Groenbech-Jensen and Farago": (gjf, 2),
    "OBABO": (obabo, 2),
    "exact between kicks": (between_kicks, 2),
    "friction and noise as forces": (forces_in_verlet, 3),
}


def maps(scheme, size, a, stiffness):
    """The matrices M and N of a step z' = M z + N g."""
    at_rest = np.zeros(2)
    columns = [scheme(unit, at_rest, a, lambda x: -stiffness * x) for unit in np.eye(size)]
    noises = [scheme(np.zeros(size), unit, a, lambda x: -stiffness * x) for unit in np.eye(2)]
    return np.array(columns).T, np.array(noises).T


def variance(scheme, size, a, stiffness):
    """<x^2> k / kT in a trap; infinity if the step is unstable."""
    step, noise = maps(scheme, size, a, stiffness)
    if np.abs(np.linalg.eigvals(step)).max() >= 1:
        return np.inf
    return stiffness * solve_discrete_lyapunov(step, noise @ noise.T)[0, 0]


def diffusion(scheme, size, a):
    """D gamma / kT of a free particle."""
    step, noise = maps(scheme, size, a, 0.0)
    inner = step[1:, 1:]
    if np.abs(np.linalg.eigvals(inner)).max() >= 1:
        return np.inf
    # Each normal number moves the particle at once, and through the velocity that it leaves.
    far = noise[0] + step[0, 1:] @ np.linalg.solve(np.eye(size - 1) - inner, noise[1:])
    return a * far @ far / 2


def drift(scheme, size, a):
    """The mean velocity under a constant force F, over F/gamma."""
    z, at_rest = np.zeros(size), np.zeros(2)
    for _ in range(int(200 / min(a, 1.0))):
        before, z = z[0], scheme(z, at_rest, a, lambda x: 1.0)
        if abs(z[0]) > 1e9:
            return np.inf
    return a * (z[0] - before)


def main():
    print(f"omega dt = {np.sqrt(STIFFNESS):.2f} in the trap")
    print("| scheme |", " | ".join(f"a = {a:g}" for a in FRICTIONS), "|")
    for name, (scheme, size) in SCHEMES.items():
        cells = []
        for a in FRICTIONS:
            values = variance(scheme, size, a, STIFFNESS), diffusion(scheme, size, a), drift(scheme, size, a)
            cells.append(", ".join(f"{value:.3f}" if value < 1e3 else "unstable" for value in values))
        print(f"| {name} |", " | ".join(cells), "|")


if __name__ == "__main__":
    main()
