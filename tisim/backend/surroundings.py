"""The surroundings of the process are made fit for the kernel compiler before it is loaded.

Taichi 1.7.4 and Quadrants 1.3.3 end the process where HOME is not set. They take options from variables of
the environment, such as TI_ARCH or QD_DEBUG, which go before those that tisim gives, and end the process or
raise where they make no sense. They ask for the working directory, which may have been removed; and Taichi
for the locale, which may be one that Python does not know.
"""

from __future__ import annotations

import locale
import os
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import resource
except ImportError:
    resource = None  # type: ignore[assignment]

from tisim.streams import fill_standard_descriptors

OPTION_PREFIXES = ("TI_", "QD_", "TAICHI_", "QUADRANTS_", "_QD_", "ENABLE_TAICHI_", "ENABLE_QUADRANTS_")
"""Variables of these names are options of the compilers. They are removed from the environment of the
process, as tisim has options of its own for what they set."""
COMPILERS = ("TI", "QD")
KEPT = {
    "TI_OFFLINE_CACHE_FILE_PATH": None,
    "QD_OFFLINE_CACHE_FILE_PATH": None,
    "TI_OFFLINE_CACHE": ("0", "1"),
    "QD_OFFLINE_CACHE": ("0", "1"),
    "TI_ADVANCED_OPTIMIZATION": ("0", "1"),
}
"""Options that stay, with the values that they take (None for any): where compiled kernels are kept, whether
they are, and whether Taichi takes longer for code that may be quicker. No result depends on them. Without its
passes Quadrants, up to 1.4, compiles some kernels to code that does nothing."""
SET = {"SKIP_VERSION_CHECK": "ON", "LOG_LEVEL": "warn"}
"""Options that are set: no call over the network for the newest version, and no announcements."""


def prepare() -> None:
    """Make the process fit for the import of a compiler; it is called once, before that."""
    fill_standard_descriptors()
    _replace_options()
    _name_cache_folder()
    _name_locale()
    _name_temporary_folder()


def _replace_options() -> None:
    """Remove the compilers' options from the environment but those that stay, and set those of tisim."""
    for name in [name for name in os.environ if name.startswith(OPTION_PREFIXES)]:
        allowed = KEPT.get(name, ())
        if allowed is not None and os.environ[name] not in allowed:
            del os.environ[name]
    for compiler in COMPILERS:
        os.environ.update({f"{compiler}_{option}": value for option, value in SET.items()})
    for package in ("TAICHI", "QUADRANTS"):
        os.environ[f"ENABLE_{package}_HEADER_PRINT"] = "0"


def _name_cache_folder() -> None:
    """Name the folder for caches where HOME does not lead to it: that of the user's entry of the system.

    The compilers look at XDG_CACHE_HOME first. A path that is empty or not absolute counts as none.
    """
    if not Path(os.environ.get("XDG_CACHE_HOME", "")).is_absolute():
        os.environ.pop("XDG_CACHE_HOME", None)
        if not Path(os.environ.get("HOME", "")).is_absolute():
            os.environ["XDG_CACHE_HOME"] = str(_home() / ".cache")


def _name_locale() -> None:
    """Name the plain locale where the environment names one that Python has never heard of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            locale.getdefaultlocale()
        except ValueError:
            os.environ["LC_ALL"] = "C.UTF-8"


def _name_temporary_folder() -> None:
    """Name the null device as the folder for temporary files where there is none.

    Packages that the compilers import ask for its name; whoever makes a file in it is told that it cannot.
    """
    try:
        tempfile.gettempdir()
    except FileNotFoundError:
        tempfile.tempdir = os.devnull


def _home() -> Path:
    """Return the home folder of the user by the system; a folder that cannot be where it knows of none."""
    try:
        import pwd

        return Path(pwd.getpwuid(os.getuid()).pw_dir)
    except (ImportError, KeyError):
        return Path(os.devnull) / "home"


CONTROL_GROUPS = Path("/sys/fs/cgroup")
"""The folder of Linux that has the limits of containers and of batch systems."""
NO_LIMIT = 2**62
"""Control groups of version 1 say a number of bytes above this where there is no limit."""


def address_space() -> int:
    """Return the limit of the address space of this process (ulimit -v), bytes; ``sys.maxsize`` where there
    is none."""
    most = -1 if resource is None else resource.getrlimit(resource.RLIMIT_AS)[0]
    return most if most >= 0 else sys.maxsize


def memory_limit() -> int:
    """Return the memory that this process may have, bytes, whatever the machine has: the limit of its address
    space (ulimit -v) or of its control group; ``sys.maxsize`` where there is none."""
    limits = [address_space()]
    try:
        groups = Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines()
    except OSError:
        groups = []
    for controllers, path in (line.split(":", 2)[1:] for line in groups):
        if controllers == "":
            limits += _group_limits(CONTROL_GROUPS, path, "memory.max")
        elif "memory" in controllers.split(","):
            limits += _group_limits(CONTROL_GROUPS / "memory", path, "memory.limit_in_bytes")
    return min(limits)


def _group_limits(root: Path, path: str, name: str) -> Iterator[int]:
    """Yield the limits of a control group and of those that it is in; in a container its own is the root."""
    group = Path(path.lstrip("/"))
    for folder in (group, *group.parents):
        try:
            text = (root / folder / name).read_text(encoding="utf-8").strip()
        except OSError:
            continue
        if text.isdecimal() and int(text) < NO_LIMIT:
            yield int(text)


@contextmanager
def existing_folder() -> Iterator[None]:
    """Work in the root folder within this context where the working directory has been removed."""
    try:
        Path.cwd()
    except FileNotFoundError:
        removed = os.open(".", os.O_RDONLY)
        try:
            os.chdir("/")
            yield
        finally:
            os.fchdir(removed)
            os.close(removed)
    else:
        yield
