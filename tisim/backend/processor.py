"""The processor of this machine, and the versions of LLVM that know it.

An LLVM that does not know a processor compiles for an older or a generic one, with shorter vectors.
"""

import platform
from pathlib import Path

FIRST_LLVM = {
    ("AuthenticAMD", 25, 0x10, 0x1F): ("znver4", 16),
    ("AuthenticAMD", 25, 0x60, 0x7F): ("znver4", 16),
    ("AuthenticAMD", 25, 0xA0, 0xAF): ("znver4", 16),
    ("AuthenticAMD", 26, 0x00, 0xFF): ("znver5", 19),
    ("GenuineIntel", 6, 143, 143): ("sapphirerapids", 12),
    ("GenuineIntel", 6, 207, 207): ("emeraldrapids", 16),
    ("GenuineIntel", 6, 173, 174): ("graniterapids", 16),
    ("GenuineIntel", 6, 170, 172): ("meteorlake", 16),
    ("GenuineIntel", 6, 183, 183): ("raptorlake", 16),
    ("GenuineIntel", 6, 197, 198): ("arrowlake", 17),
}
"""The name and the first LLVM of x86 processors by vendor, family, lowest and highest model.

LLVM, llvm/lib/TargetParser/Host.cpp and release notes of 12 to 19.
"""
KNOWN_LONG_SINCE = {"AuthenticAMD": (25, 0x5F), "GenuineIntel": (6, 167)}
"""The last family and model of each vendor before the table; LLVM 12 knows all up to it."""
OLDEST = 12
"""The oldest LLVM of any backend."""


def processor() -> dict[str, str]:
    """Return the entries of the first processor in /proc/cpuinfo, or only its name if that file cannot be
    read."""
    entries: dict[str, str] = {}
    try:
        # Not the whole file, as the kernel collects the entries of each core, which may be hundreds.
        with Path("/proc/cpuinfo").open() as lines:
            for line in lines:
                if not line.strip():
                    break
                key, _, value = line.partition(":")
                entries[key.strip()] = value.strip()
    except OSError:
        entries = {}
    return entries or {"model name": platform.processor() or platform.machine()}


def first_llvm(cpu: dict[str, str]) -> tuple[str, int | None]:
    """Return LLVM's name of a processor, and the major version of the first LLVM that knows it.

    The name is empty if the table has none. The version is None for a processor that is newer than the table
    or of another vendor, for which no LLVM version is known.
    """
    try:
        vendor, family, model = cpu["vendor_id"], int(cpu["cpu family"]), int(cpu["model"])
    except (KeyError, ValueError):
        return "", None
    for (maker, generation, low, high), (name, first) in FIRST_LLVM.items():
        if (vendor, family) == (maker, generation) and low <= model <= high:
            return name, first
    known = vendor in KNOWN_LONG_SINCE and (family, model) <= KNOWN_LONG_SINCE[vendor]
    return "", OLDEST if known else None


def knows(llvm: int, cpu: dict[str, str]) -> bool:
    """Return whether an LLVM of this major version is known to know a processor."""
    _, first = first_llvm(cpu)
    return first is not None and llvm >= first


def support(llvm: int, cpu: dict[str, str]) -> str:
    """Return a sentence that says whether an LLVM of this major version knows a processor."""
    name, first = first_llvm(cpu)
    if first is None:
        return f"not in tisim's table of processors that LLVM {llvm} knows"
    if llvm >= first:
        return f"known to LLVM {llvm}" + (f" as {name}" if name else "")
    return f"{name} is known from LLVM {first} on, not to LLVM {llvm}"
