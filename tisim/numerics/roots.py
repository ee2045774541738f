"""Roots by estimates with high-order corrections."""

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.ieee import is_fast


def estimates_roots() -> bool:
    """Return whether estimates pay: in fast arithmetic on a CPU in f64.

    There roots and divisions take four times as long as in f32, which uses the hardware.
    """
    now = runtime.current()
    return is_fast() and now.device == "cpu" and now.precision == "f64"


@ti.func
def inverse_root(x):
    """Return 1/sqrt(x) of a number of the precision in use.

    If estimates pay, it is accurate to two units in the last place for 1e-37 < x < 1e38; below the range of
    f32 it is then not finite, and above it 0. The hardware estimate in f32 is followed by a step of third
    order (E. Halley):

        y (15/8 - 5/4 h + 3/8 h^2),    h = x y^2
    """
    y = 1.0 / ti.sqrt(x)
    if ti.static(estimates_roots()):
        y = ti.cast(ti.cast(1.0, ti.f32) / ti.sqrt(ti.cast(x, ti.f32)), ti.f64)
        h = x * y * y
        y *= 1.875 - h * (1.25 - 0.375 * h)
    return y


CUBE_ROOT_OFFSET = 0x2A9F7893 << 32
"""The bits of a cube root are about a third of the bits of the number, plus this offset (W. Kahan)."""


@ti.func
def cube_root(x):
    """Return the cube root of x >= 0, of its type, to two units in the last place, without a branch.

    Three steps of E. Halley follow an estimate with an error of at most 5 %: y (y^3 + 2 x) / (2 y^3 + x).
    """
    wide = ti.cast(x, ti.f64)
    y = ti.bit_cast(ti.bit_cast(wide, ti.i64) // 3 + ti.i64(CUBE_ROOT_OFFSET), ti.f64)
    for _ in ti.static(range(3)):
        cube = y * y * y
        y *= (cube + 2.0 * wide) / (2.0 * cube + wide)
    root = 0.0 * x
    root = ti.select(wide > 0.0, y, 0.0)
    return root
