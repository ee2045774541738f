"""The only import of Taichi, or of its maintained fork Quadrants when TISIM_BACKEND=quadrants.

Everything else writes ``from tisim.backend.taichi import ti``. Only what both packages offer is used.
"""

from __future__ import annotations

import importlib.util
import os
import warnings

from tisim.backend import front_end, surroundings
from tisim.errors import must

BACKEND = os.environ.get("TISIM_BACKEND", "taichi")
"""This package compiles the kernels: ``"taichi"`` or ``"quadrants"``."""


def check_backend() -> None:
    """Raise InputError unless TISIM_BACKEND names one of the two packages, and it is installed.

    The import goes on with Taichi, so that this is said in a line where the runtime or a command starts.
    """
    must(BACKEND in ("taichi", "quadrants"), "TISIM_BACKEND", "taichi or quadrants", BACKEND)
    rule = "installed (python -m pip install 'tisim[quadrants]') or left out"
    must(importlib.util.find_spec(BACKEND) is not None, "TISIM_BACKEND", rule, BACKEND)


surroundings.prepare()
if BACKEND == "quadrants" and importlib.util.find_spec("quadrants") is not None:
    import quadrants as ti
else:
    with warnings.catch_warnings():
        # Taichi 1.7.4 imports with deprecations of newer Pythons; they are not ours to mend.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", SyntaxWarning)
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


__all__ = ["BACKEND", "DEVICE_FUNCTION", "check_backend", "is_device_function", "ti"]
