"""The only import of Taichi, or of its maintained fork Quadrants when TISIM_BACKEND=quadrants.

Everything else writes ``from tisim._taichi import ti``. Only what both packages offer is used.
"""

from __future__ import annotations

import os
import warnings

BACKEND = os.environ.get("TISIM_BACKEND", "taichi")
"""The package that compiles the kernels: ``"taichi"`` or ``"quadrants"``."""

# No banner, and no call over the network for the newest version.
for prefix in ("TI", "QD"):
    os.environ.setdefault(f"{prefix}_SKIP_VERSION_CHECK", "ON")
    os.environ.setdefault(f"{prefix}_LOG_LEVEL", "warn")
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")

if BACKEND == "taichi":
    with warnings.catch_warnings():
        # Taichi 1.7.4 imports with deprecations of newer Pythons; they are not ours to mend.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", SyntaxWarning)
        import taichi as ti
elif BACKEND == "quadrants":
    try:
        import quadrants as ti
    except ImportError as missing:
        raise ImportError(
            "TISIM_BACKEND=quadrants needs the extra: python -m pip install 'tisim[quadrants]'"
        ) from missing
else:
    raise ImportError(f"TISIM_BACKEND must be 'taichi' or 'quadrants'; received {BACKEND!r}")


class _Probe:
    @ti.func
    def function(self):
        pass


DEVICE_FUNCTION: type = type(_Probe.__dict__["function"])
"""The type of a method decorated with ``ti.func`` (the packages differ); validated models let it pass."""

__all__ = ["BACKEND", "DEVICE_FUNCTION", "ti"]
