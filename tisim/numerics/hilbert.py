"""Index of a cell along Hilbert's curve, which visits all cells of a cube and always moves to a neighbour."""

from tisim.backend.taichi import ti

CURVE_BITS = 16
"""The cube has 2^CURVE_BITS cells along each edge."""


@ti.func
def hilbert_index(cell):
    """Return the index (i64) of a cell along the curve, given its index along each axis, below 2^CURVE_BITS.

    Any stretch of the curve covers a connected region of about equal width along all axes.

    Source: J. Skilling, AIP Conf. Proc. 707 (2004) 381.
    """
    x = cell
    # From the highest bit down, undo the rotations of the nested cubes.
    for bit in range(CURVE_BITS - 1):
        q = 1 << (CURVE_BITS - 1 - bit)
        low = q - 1
        for a in ti.static(range(3)):
            if x[a] & q:
                x[0] ^= low
            else:
                swapped = (x[0] ^ x[a]) & low
                x[0] ^= swapped
                x[a] ^= swapped
    # Gray code of the three indices.
    x[1] ^= x[0]
    x[2] ^= x[1]
    flips = 0
    for bit in range(CURVE_BITS - 1):
        q = 1 << (CURVE_BITS - 1 - bit)
        if x[2] & q:
            flips ^= q - 1
    index = ti.cast(0, ti.i64)
    for bit in range(CURVE_BITS):
        shift = CURVE_BITS - 1 - bit
        for a in ti.static(range(3)):
            index = index << 1 | ti.cast((x[a] ^ flips) >> shift & 1, ti.i64)
    return index
