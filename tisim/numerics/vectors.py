"""Vector slicing in kernels."""

from tisim.backend.taichi import ti


@ti.func
def piece(vector, begin: ti.template(), size: ti.template()):  # type: ignore[valid-type]
    """Return ``size`` components of a vector from ``begin`` on."""
    return ti.Vector([vector[begin + k] for k in ti.static(range(size))])
