"""Whether a process may go on to launch kernels on Mesa's software device for Vulkan.

There each loop of a kernel, whenever it is launched, takes a page of memory that is mapped by itself and is
never given back (a set of descriptors, which Taichi does not free). Linux allows a process 65,530 mappings
unless told otherwise, and beyond them the driver crashes.
"""

from pathlib import Path

from tisim.errors import RunError

MAPPINGS, LIMIT = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")
FREE_MAPPINGS = 0.2
"""This part of what is allowed is left for what is launched before anybody asks again."""


def require_mappings() -> None:
    """Raise RunError where a process on Linux has used up nearly all mappings."""
    if not LIMIT.exists():
        return
    limit, used = int(LIMIT.read_text()), MAPPINGS.read_bytes().count(b"\n")
    if used > (1.0 - FREE_MAPPINGS) * limit:
        raise RunError(
            f"mappings of memory must stay below {limit}; received {used}: this driver takes one for each "
            f"loop that is launched (sysctl vm.max_map_count allows for more)"
        )
