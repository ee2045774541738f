"""Kernels without arguments that are launched again and again, such as those of a step.

Taichi 1.7.4 takes about 22 us of Python to launch a kernel of an object (2 cores of an Intel Xeon, Sapphire
Rapids), most of them to find which compiled kernel the arguments ask for. Without arguments that is the same
one each time, and to launch it takes 1 us. Quadrants looks it up in 4 us by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tisim.backend.taichi import ti


class Launcher:
    """A launcher calls a kernel of an object, one that takes no arguments, and returns what it returns: a
    whole number, or nothing.

    The first call compiles it. As the kernel, it must not be called after Taichi has been started anew.
    """

    def __init__(self, kernel: Callable[[], Any]) -> None:
        self._kernel = kernel
        self._launch: Callable[[], Any] | None = None

    def __call__(self) -> Any:
        if self._launch is not None:
            return self._launch()
        result = self._kernel()
        self._launch = _direct(self._kernel) if ti.__name__ == "taichi" else self._kernel
        return result


def _direct(kernel: Any) -> Callable[[], Any]:
    """Return what launches a kernel that Taichi has compiled."""
    definition = kernel._primal
    program = ti.lang.impl.get_runtime().prog
    compiled = definition.compiled_kernels[definition.ensure_compiled(kernel._kernel_owner)]
    code = program.compile_kernel(program.config(), program.get_device_caps(), compiled)

    def launch() -> None:
        program.launch_kernel(code, compiled.make_launch_context())

    def launch_and_read() -> int:
        context = compiled.make_launch_context()
        program.launch_kernel(code, context)
        program.synchronize()
        return int(context.get_struct_ret_int((0,)))

    return launch_and_read if definition.return_type else launch
