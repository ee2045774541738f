"""Preparation of the process environment before the kernel compiler is imported.

Taichi 1.7.4 and Quadrants 1.3.3 end the process if HOME is not set. They take options from environment
variables such as TI_ARCH or QD_DEBUG, which override the options of tisim, and end the process or raise
errors for invalid values. They query the working directory, which may have been removed, and Taichi queries
the locale, which may be unknown to Python.
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
"""Prefixes of variables that are options of the compilers. They are removed from the environment, as tisim
has its own options for these settings."""
COMPILERS = ("TI", "QD")
KEPT = {
    "TI_OFFLINE_CACHE_FILE_PATH": None,
    "QD_OFFLINE_CACHE_FILE_PATH": None,
    "TI_OFFLINE_CACHE": ("0", "1"),
    "QD_OFFLINE_CACHE": ("0", "1"),
    "TI_ADVANCED_OPTIMIZATION": ("0", "1"),
}
"""Options that are kept, with their allowed values (None for any): the folder of the kernel cache, whether
kernels are cached, and whether Taichi spends more time on optimization. They do not affect results. Without
its optimization passes Quadrants, up to 1.4, compiles some kernels to code that does nothing."""
SET = {"SKIP_VERSION_CHECK": "ON", "LOG_LEVEL": "warn"}
"""Options that are set: no query over the network for the newest version, and no announcements."""


def prepare() -> None:
    """Prepare the process for the import of a compiler; called once, before it."""
    fill_standard_descriptors()
    _replace_options()
    _name_cache_folder()
    _name_locale()
    _name_temporary_folder()


def _replace_options() -> None:
    """Remove the compilers' options from the environment, except the kept ones, and set the options of
    tisim."""
    for name in [name for name in os.environ if name.startswith(OPTION_PREFIXES)]:
        allowed = KEPT.get(name, ())
        if allowed is not None and os.environ[name] not in allowed:
            del os.environ[name]
    for compiler in COMPILERS:
        os.environ.update({f"{compiler}_{option}": value for option, value in SET.items()})
    for package in ("TAICHI", "QUADRANTS"):
        os.environ[f"ENABLE_{package}_HEADER_PRINT"] = "0"


def _name_cache_folder() -> None:
    """Set the cache folder if HOME does not give one, from the home folder of the user in the system.

    The compilers read XDG_CACHE_HOME first. A path that is empty or not absolute is ignored.
    """
    if not Path(os.environ.get("XDG_CACHE_HOME", "")).is_absolute():
        os.environ.pop("XDG_CACHE_HOME", None)
        if not Path(os.environ.get("HOME", "")).is_absolute():
            os.environ["XDG_CACHE_HOME"] = str(_home() / ".cache")


def _name_locale() -> None:
    """Set the plain locale if Python does not know the locale of the environment."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            locale.getdefaultlocale()
        except ValueError:
            os.environ["LC_ALL"] = "C.UTF-8"


def _name_temporary_folder() -> None:
    """Set the null device as the folder for temporary files if there is none.

    Packages that the compilers import ask for the name of the folder; creating a file in it gives an error.
    """
    try:
        tempfile.gettempdir()
    except FileNotFoundError:
        tempfile.tempdir = os.devnull


def _home() -> Path:
    """Return the home folder of the user from the system, or a path that cannot exist if there is none."""
    try:
        import pwd

        return Path(pwd.getpwuid(os.getuid()).pw_dir)
    except (ImportError, KeyError):
        return Path(os.devnull) / "home"


CONTROL_GROUPS = Path("/sys/fs/cgroup")
"""Folder on Linux with the limits of containers and batch systems."""
NO_LIMIT = 2**62
"""Control groups of version 1 without a limit report a number of bytes above this."""


def address_space() -> int:
    """Return the limit of the address space of this process (ulimit -v), bytes; ``sys.maxsize`` if there is
    none."""
    most = -1 if resource is None else resource.getrlimit(resource.RLIMIT_AS)[0]
    return most if most >= 0 else sys.maxsize


def memory_limit() -> int:
    """Return the memory limit of this process, bytes; ``sys.maxsize`` if there is none.

    It is the limit of its address space (ulimit -v) or of its control group, for any memory of the machine.
    """
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
    """Yield the limits of a control group and of its parents; in a container its own group is the root."""
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
    """Work in the root folder within this context if the working directory has been removed."""
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
