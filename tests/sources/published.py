"""B16's formulas for a magnetised cylinder, in enough digits to make cancellation harmless."""

import mpmath as mp
import numpy as np

MU_0 = mp.mpf("1.25663706127e-6")


def flux_density(point, radius, half, m):
    """B (T) of a cylinder along z about the origin with M = m: B16 Eqs (5.1)-(5.6), (5.20)-(5.22)."""
    x, y, z = point
    rho = mp.sqrt(x * x + y * y)
    phi = mp.atan2(y, x)
    along, across, turn = m[2], mp.sqrt(m[0] ** 2 + m[1] ** 2), mp.atan2(m[1], m[0])
    gamma = (rho - radius) / (rho + radius)
    n = 1 - gamma**2
    sums = dict.fromkeys(["a1", "b2", "b3", "b4"], mp.mpf(0))
    for sign in (1, -1):
        xi = z + sign * half
        alpha = 1 / mp.sqrt(xi**2 + (rho + radius) ** 2)
        beta = xi * alpha
        k2 = (xi**2 + (rho - radius) ** 2) / (xi**2 + (rho + radius) ** 2)
        first, second, third = mp.ellipk(1 - k2), mp.ellipe(1 - k2), mp.ellippi(n, 1 - k2)
        p1 = first - 2 / (1 - k2) * (first - second)
        p2 = -gamma / n * (third - first) - (gamma**2 * third - first) / n
        p3 = (first - second) / (1 - k2) - gamma**2 / n * (third - first)
        p4 = gamma / n * (third - first) + gamma / n * (gamma**2 * third - first) - p1
        for name, value in (("a1", alpha * p1), ("b2", beta * p2), ("b3", beta * p3), ("b4", beta * p4)):
            sums[name] += sign * value
    c, s = mp.cos(phi - turn), mp.sin(phi - turn)
    inside = rho < radius and abs(z) < half
    # For transverse M the formulas give H, for longitudinal M they give B.
    h_rho = across * radius * c / (2 * mp.pi * rho) * sums["b4"] + (across * c if inside else 0)
    h_phi = across * radius * s / (mp.pi * rho) * sums["b3"] - (across * s if inside else 0)
    h_z = across * radius * c / mp.pi * sums["a1"]
    b_rho = h_rho + along * radius / mp.pi * sums["a1"]
    b_z = h_z + along * radius / (mp.pi * (rho + radius)) * sums["b2"]
    e, f = (mp.cos(phi), mp.sin(phi)), (-mp.sin(phi), mp.cos(phi))
    return [MU_0 * v for v in (b_rho * e[0] + h_phi * f[0], b_rho * e[1] + h_phi * f[1], b_z)]


def field_and_gradient(point, radius, half, m):
    """B, and its gradient from differences with enough digits to be exact."""
    return anywhere(point, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), radius, 2 * half, m)


def anywhere(point, centre, axis, radius, length, magnetisation):
    """Field and gradient of a cylinder in any direction, from the exact input numbers without rounding."""
    with mp.workdps(100):
        turn, place = seen_from(point, centre, axis)
        # Shifted off the axis and the surface, where the formulas are 0/0, by less than any digit needed.
        place += radius * mp.matrix([mp.mpf(10) ** -20 * (i + 1) for i in range(3)])
        radius, half = mp.mpf(float(radius)), mp.mpf(float(length)) / 2
        arguments = radius, half, list(turn * exactly(magnetisation))
        step = radius * mp.mpf(10) ** -25
        b = mp.matrix(flux_density(place, *arguments))
        slope = mp.matrix(3, 3)
        for k in range(3):
            ahead = place.copy()
            ahead[k] += step
            slope[:, k] = (mp.matrix(flux_density(ahead, *arguments)) - b) / step
        back = turn.T
        return as_floats(back * b)[:, 0], as_floats(back * slope * turn)


def from_rim(point, centre, axis, radius, length):
    """Distance (m) of a point beyond the side of a cylinder, and beyond its ends; negative inside."""
    with mp.workdps(100):
        x, y, z = seen_from(point, centre, axis)[1]
        return float(mp.sqrt(x * x + y * y) - mp.mpf(radius)), float(abs(z) - mp.mpf(length) / 2)


def seen_from(point, centre, axis):
    """The matrix that rotates the axis of a cylinder onto the third axis, and the point in its
    coordinates."""
    turn = frame(exactly(axis))
    return turn, turn * (exactly(point) - exactly(centre))


def exactly(numbers):
    return mp.matrix([mp.mpf(float(v)) for v in numbers])


def frame(axis):
    """Orthonormal basis vectors as rows; the third is along the given axis."""
    size = mp.norm(axis)
    c = [v / size for v in axis]
    least = min(range(3), key=lambda i: abs(c[i]))
    a = [(1 if i == least else 0) - c[least] * c[i] for i in range(3)]
    size = mp.norm(mp.matrix(a))
    a = [v / size for v in a]
    b = [c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0]]
    return mp.matrix([a, b, c])


def as_floats(m):
    return np.array(m.tolist(), dtype=float)


def by_quadrature(point, radius, half, m):
    """B by integrals over phi: of charges on the side for transverse M, of surface currents for longitudinal
    M."""
    with mp.workdps(30):
        x, y, z = (mp.mpf(float(v)) for v in point)
        radius, half = mp.mpf(float(radius)), mp.mpf(float(half))

        def integral(component):
            def integrand(phi):
                c, s = mp.cos(phi), mp.sin(phi)
                dx, dy = x - radius * c, y - radius * s
                square = dx * dx + dy * dy
                up, down = z + half, z - half
                far, near = mp.sqrt(square + up * up), mp.sqrt(square + down * down)
                flat, lift = (up / far - down / near) / square, 1 / near - 1 / far
                charge = m[0] * c + m[1] * s
                b = (
                    charge * dx * flat + m[2] * c * lift,
                    charge * dy * flat + m[2] * s * lift,
                    charge * lift - m[2] * (c * dx + s * dy) * flat,
                )
                return b[component]

            here = mp.atan2(y, x)
            turns = [here + mp.pi * t for t in (-1, -0.5, -0.1, -0.01, 0, 0.01, 0.1, 0.5, 1)]
            return radius / (4 * mp.pi) * mp.quad(integrand, turns)

        inside = x * x + y * y < radius**2 and abs(z) < half
        m_inside = (m[0], m[1], 0) if inside else (0, 0, 0)
        return np.array([float(MU_0 * (integral(k) + m_inside[k])) for k in range(3)])
