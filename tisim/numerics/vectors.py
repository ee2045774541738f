"""Vectors taken apart and put together."""

from tisim.backend.taichi import ti


@ti.func
def piece(vector, begin: ti.template(), size: ti.template()):  # type: ignore[valid-type]
    """Return the components of a vector from ``begin`` on, as many as ``size``."""
    return ti.Vector([vector[begin + k] for k in ti.static(range(size))])
