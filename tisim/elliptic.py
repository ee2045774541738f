"""Complete elliptic integrals in kernels: one arithmetic-geometric mean gives all three kinds at once.

With parameter m, complementary modulus kc = sqrt(1 - m), and characteristic n = 1 - gamma^2 of the third
kind, K, E and Pi follow from the mean of 1 and kc and from sums along the way (DLMF 19.8.1-19.8.7; Gauss).
What fields need are differences of them, such as (K - E)/m - gamma^2 (Pi - K)/n, in which nearly all digits
cancel where m and n are small. The sums are the differences themselves, term by term positive.
"""

from __future__ import annotations

from tisim import runtime
from tisim._taichi import ti

LIMITS = {ti.f64: (1e-8, 1e-17), ti.f32: (1e-4, 1e-9)}
"""Relative difference at which the two means have met, as the next would be its square; and the least kc and
|gamma|, below the rounding of what they are made of."""
ITERATIONS = 16
"""More than the least kc takes."""


def limits() -> tuple[float, float]:
    """``LIMITS`` of the precision that runs."""
    return LIMITS[runtime.current().real]


@ti.func
def elliptic(kc, m, gamma, rest):
    """K, (2 (2 - m) K - 4 E) / (m^2 K), 2 gamma^2 (Pi - K) / (n K), and 1 less the last.

    For two kc side by side: all but gamma are vectors. kc > 0; gamma in 0..1, not 0; rest : n - m + gamma^2 n,
    which the caller knows without cancellation. The
    second is sigma = sum_i 2^i c_i^2 / m^2 (i = 1, 2, ...), so that E = K (1 - m/2 - m^2 sigma/2).
    """
    met = ti.static(limits()[0])
    square = gamma * gamma
    pole = square + kc
    sigma = 0.5 / (1.0 + kc) ** 2
    third, weight = 2.0 * square / pole, 0.5 * rest / (pole * pole)
    other, p = 0.0 * kc, 0.5 * pole / gamma
    a, g, scale = 0.5 * (1.0 + kc), ti.sqrt(kc), 1.0 / (m * m)
    k = 0
    while (ti.abs(a - g) - met * a).max() > 0.0 and k < ITERATIONS:
        product = a * g
        pole = p * p + product
        inverse = 1.0 / (pole * p)
        share = product * p * inverse
        other += weight
        third += 2.0 * weight * share
        weight *= 0.5 - share
        p = 0.5 * pole * pole * inverse
        scale *= 2.0
        sigma += 0.5 * scale * (a - g) ** 2
        a, g = 0.5 * (a + g), ti.sqrt(product)
        k += 1
    sigma += scale * (a - g) ** 2
    mean = 0.5 * (a + g)
    # The means have met: the rest of the sums over p in closed form.
    last = 2.0 * weight / (mean + p)
    return 0.5 * ti.math.pi / mean, sigma, third + last * mean, other + last * p
