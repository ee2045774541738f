"""Complete elliptic integrals in kernels: one arithmetic-geometric mean gives all three kinds at once.

With parameter m, complementary modulus kc = sqrt(1 - m), and characteristic n = 1 - gamma^2 of the third
kind, K, E and Pi follow from the mean of 1 and kc and from sums along the way (DLMF 19.8.1-19.8.7; Gauss).
What fields need are differences of them, such as (K - E)/m - gamma^2 (Pi - K)/n, in which nearly all digits
cancel where m and n are small. The sums are the differences themselves, term by term positive.
"""

from __future__ import annotations

from tisim.backend import runtime
from tisim.backend.taichi import ti

LIMITS = {ti.f64: (1e-8, 1e-17), ti.f32: (1e-4, 1e-9)}
"""These are the relative difference at which the two means have met, as the next would be its square; and the
least kc and |gamma|, below the rounding of what they are made of."""
ITERATIONS = 16
"""The mean of the least kc has met its limit in fewer iterations than these."""


def limits() -> tuple[float, float]:
    """Return ``LIMITS`` of the precision that runs."""
    return LIMITS[runtime.current().real]


@ti.func
def elliptic(kc, over_m, gamma, over_gamma, rest):
    """Return K / pi, sigma with E = K (1 - m/2 - m^2 sigma/2), 2 gamma^2 (Pi - K) / (n K), and 1 less the
    last.

    Two kc go side by side: all but gamma are vectors. kc > 0; gamma in 0..1, not 0. over_m : 1/m.
    over_gamma : 1/gamma. rest : n - m + gamma^2 n, which the caller knows without cancellation.
    sigma = sum_i 2^i c_i^2 / m^2, i >= 1.
    """
    tolerance = ti.static(limits()[0])
    square = gamma * gamma
    pole = square + kc
    over_pole, over_both = 1.0 / pole, 1.0 / (1.0 + kc)
    sigma = 0.5 * over_both * over_both
    third, weight = 2.0 * square * over_pole, 0.5 * rest * over_pole * over_pole
    other, p = 0.0 * kc, 0.5 * pole * over_gamma
    a, g, scale = 0.5 * (1.0 + kc), ti.sqrt(kc), over_m * over_m
    k = 0
    while (ti.abs(a - g) - tolerance * a).max() > 0.0 and k < ITERATIONS:
        product, apart = a * g, a - g
        pole = p * p + product
        inverse = 1.0 / (pole * p)
        share = product * p * inverse
        other += weight
        third += 2.0 * weight * share
        weight *= 0.5 - share
        p = 0.5 * pole * pole * inverse
        scale *= 2.0
        sigma += 0.5 * scale * apart * apart
        a, g = 0.5 * (a + g), ti.sqrt(product)
        k += 1
    sigma += scale * (a - g) * (a - g)
    mean = 0.5 * (a + g)
    # The means have met: the rest of the sums over p in closed form.
    last = 2.0 * weight / (mean + p)
    return 0.5 / mean, sigma, third + last * mean, other + last * p
