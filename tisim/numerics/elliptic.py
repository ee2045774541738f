"""Complete elliptic integrals in kernels: one arithmetic-geometric mean gives all three kinds at once.

With parameter m, complementary modulus kc = sqrt(1 - m), and characteristic n = 1 - gamma^2 of the third
kind, K, E and Pi follow from the mean of 1 and kc and from sums over its iterations (DLMF 19.8.1-19.8.7;
Gauss). Field formulas need differences such as (K - E)/m - gamma^2 (Pi - K)/n, in which nearly all digits
cancel for small m and n. The sums computed here are these differences directly, with positive terms only.
"""

from tisim.backend import runtime
from tisim.backend.taichi import ti

LIMITS = {ti.f64: (1e-8, 1e-17), ti.f32: (1e-4, 1e-9)}
"""Two limits for each type: the relative difference at which the two means count as equal, as the next
difference would be its square; and the least kc and |gamma|, below the rounding of the numbers they are
computed from."""
ITERATIONS = 16
"""Upper bound of the iterations: the mean of the least kc reaches its limit in fewer."""
MOSTLY = 3
"""Iterations that suffice for most kc, those above 0.09."""


def limits() -> tuple[float, float]:
    """Return ``LIMITS`` of the precision in use."""
    return LIMITS[runtime.current().real]


@ti.func
def elliptic(kc, over_m, gamma, over_gamma, rest, mostly: ti.template()):  # type: ignore[valid-type]
    """Return K / pi, sigma with E = K (1 - m/2 - m^2 sigma/2), 2 gamma^2 (Pi - K) / (n K), 1 minus the last,
    and whether the mean has reached its limit.

    Two kc are computed side by side: all arguments but gamma are vectors. kc > 0; gamma in 0..1, not 0.

    over_m : 1/m. over_gamma : 1/gamma.
    rest : n - m + gamma^2 n, which the caller knows without cancellation.
    mostly : whether to make ``MOSTLY`` iterations without a loop, so that compilers can vectorise it.

    sigma = sum_i 2^i c_i^2 / m^2, i >= 1.
    """
    square = gamma * gamma
    pole = square + kc
    over_pole, over_both = 1.0 / pole, 1.0 / (1.0 + kc)
    # Rows: the means a and g, p, 2^i / m^2, the sum sigma, and a weight and two sums over p.
    rows = ti.Matrix.rows(
        [
            0.5 * (1.0 + kc),
            ti.sqrt(kc),
            0.5 * pole * over_gamma,
            over_m * over_m,
            0.5 * over_both * over_both,
            0.5 * rest * over_pole * over_pole,
            2.0 * square * over_pole,
            0.0 * kc,
        ]
    )
    if ti.static(mostly):
        for _ in ti.static(range(MOSTLY)):
            rows = ti.select(_apart(rows), _iterate(rows), rows)
    else:
        k = 0
        while _apart(rows) and k < ITERATIONS:
            rows = _iterate(rows)
            k += 1
    a, g, p, scale, sigma, weight, third, other = _split(rows)
    sigma += scale * (a - g) * (a - g)
    mean = 0.5 * (a + g)
    # The means are equal: the rest of the sums over p in closed form.
    last = 2.0 * weight / (mean + p)
    return 0.5 / mean, sigma, third + last * mean, other + last * p, not _apart(rows)


@ti.func
def _split(rows):
    """Return the rows as a list."""
    return [rows[i, :] for i in ti.static(range(8))]


@ti.func
def _apart(rows):
    """Return whether the two means differ by more than the tolerance, for either kc."""
    a, g = rows[0, :], rows[1, :]
    return (ti.abs(a - g) - ti.static(limits()[0]) * a).max() > 0.0


@ti.func
def _iterate(rows):
    """Return the rows after one more iteration of the mean."""
    a, g, p, scale, sigma, weight, third, other = _split(rows)
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
    return ti.Matrix.rows([0.5 * (a + g), ti.sqrt(product), p, scale, sigma, weight, third, other])
