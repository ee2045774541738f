"""The only import of Taichi, or of its maintained fork Quadrants (``choice.py`` says which).

Everything else writes ``from tisim.backend.taichi import ti``. Only what both packages offer is used.
"""

from __future__ import annotations

import warnings

from tisim.backend import choice, front_end, surroundings

BACKEND = choice.chosen()
"""This package compiles the kernels: ``"taichi"`` or ``"quadrants"``."""

surroundings.prepare()
with front_end.quick_import(), warnings.catch_warnings():
    # Taichi 1.7.4 imports with deprecations of newer Pythons; they are not ours to mend.
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
"""This is the type of a method decorated with ``ti.func`` (the packages differ); validated models let it
pass."""


def is_device_function(value: object) -> bool:
    """Return whether this is a function decorated with ``ti.func``."""
    return bool(getattr(value, f"_is_{ti.__name__}_function", False))


__all__ = ["BACKEND", "DEVICE_FUNCTION", "is_device_function", "ti"]
