"""The only import of Taichi, or of its maintained fork Quadrants (``choice.py`` selects one).

All other modules use ``from tisim.backend.taichi import ti``, and only features that both packages have.
"""

from __future__ import annotations

import warnings

from tisim.backend import choice, front_end, surroundings

BACKEND = choice.chosen()
"""The package that compiles the kernels: ``"taichi"`` or ``"quadrants"``."""

surroundings.prepare()
with front_end.quick_import(), warnings.catch_warnings():
    # The import of Taichi 1.7.4 gives deprecation warnings in newer Pythons, which are not tisim's.
    warnings.simplefilter("ignore", DeprecationWarning)
    warnings.simplefilter("ignore", SyntaxWarning)
    if BACKEND == "quadrants":
        import quadrants as ti
    else:
        import taichi as ti
front_end.relieve(ti.__name__)


class _Probe:
    @ti.func
    def function(self):
        pass


DEVICE_FUNCTION: type = type(_Probe.__dict__["function"])
"""Type of a method decorated with ``ti.func``, which differs between the packages; validated models accept
it."""


def is_device_function(value: object) -> bool:
    """Return whether a value is a function decorated with ``ti.func``."""
    return bool(getattr(value, f"_is_{ti.__name__}_function", False))


__all__ = ["BACKEND", "DEVICE_FUNCTION", "is_device_function", "ti"]
