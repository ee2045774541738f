"""A check that a process may launch more kernels on Mesa's software device for Vulkan.

On this device each launched loop of a kernel maps a page of memory that is never freed (a descriptor set,
which Taichi does not free). Linux allows a process 65,530 mappings by default, and beyond this number the
driver crashes.
"""

from pathlib import Path

from tisim.errors import RunError

MAPPINGS, LIMIT = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")
FREE_MAPPINGS = 0.2
"""Fraction of the allowed mappings reserved for launches before the next check."""


def require_mappings() -> None:
    """Raise RunError on Linux if the process has used nearly all mappings."""
    if not LIMIT.exists():
        return
    limit, used = int(LIMIT.read_text()), MAPPINGS.read_bytes().count(b"\n")
    if used > (1.0 - FREE_MAPPINGS) * limit:
        raise RunError(
            f"mappings of memory must stay below {limit}; received {used}: this driver takes one for each "
            f"loop that is launched (sysctl vm.max_map_count allows for more)"
        )
