"""Fast launches of kernels that run again and again, such as the kernels of a step.

Taichi 1.7.4 takes about 22 us of Python to launch a kernel of an object (2 cores of an Intel Xeon, Sapphire
Rapids), mostly to find the compiled kernel for the types of the arguments. For integer arguments it is always
the same one, and a direct launch takes 1 us. Quadrants itself finds it in 4 us.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tisim.backend.taichi import ti


class Launcher:
    """A launcher calls a kernel of an object with integer arguments, and returns its integer result, if it
    has one.

    The first call compiles the kernel. Like the kernel, the launcher must not be called after Taichi has been
    restarted.
    """

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self._kernel = kernel
        self._launch: Callable[..., Any] | None = None

    def __call__(self, *arguments: int) -> Any:
        if self._launch is not None:
            return self._launch(*arguments)
        result = self._kernel(*arguments)
        self._launch = _direct(self._kernel, arguments) if ti.__name__ == "taichi" else self._kernel
        return result


def _direct(kernel: Any, arguments: tuple[int, ...]) -> Callable[..., Any]:
    """Return a function that launches a kernel compiled by Taichi for such arguments."""
    definition = kernel._primal
    program = ti.lang.impl.get_runtime().prog
    key = definition.ensure_compiled(kernel._kernel_owner, *arguments)
    compiled = definition.compiled_kernels[key]
    code = program.compile_kernel(program.config(), program.get_device_caps(), compiled)

    def launch(*arguments: int) -> int | None:
        context = compiled.make_launch_context()
        for place, argument in enumerate(arguments):
            context.set_arg_int((place,), argument)
        program.launch_kernel(code, context)
        if not definition.return_type:
            return None
        program.synchronize()
        return int(context.get_struct_ret_int((0,)))

    return launch
