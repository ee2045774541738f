"""Fingerprints of functions: checksums that change whenever a function may return something else.

The cache of a search reuses the values of objectives, which are functions. The key of a value therefore
includes the code of the function and everything that it is bound to: arguments of a ``functools.partial``,
variables of enclosing functions, default values, attributes of objects, the global variables that it names,
and the same for each function that it calls. Equal fingerprints mean equal functions, in any process. An
object that cannot be compared by value is refused.

Values that were computed earlier do not count: caches of functions are emptied, so that a data file behind
them is read again, and noticed (outside.py).
"""

from __future__ import annotations

import contextlib
import enum
import functools
import hashlib
import importlib.util
import inspect
import os
import pickle
import site
import sys
import sysconfig
import types
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from tisim.errors import InputError, abbreviated
from tisim.files.python_file import is_own, sha256
from tisim.optimize.problem.lookups import ANY_ATTRIBUTE, ENVIRONMENT, Lookups

BY_REPR = (bool, int, float, complex, str, bytes, type(None), type(Ellipsis), range, slice)
"""Types whose values are fully described by ``repr``."""


def fingerprint(value: Any, what: str = "", reused: bool = False) -> str:
    """Return the fingerprint of a function, or of another value, hex.

    what : name of the value in the InputError that is raised if it is bound to an object that cannot be
        compared. If it is empty, no error is raised, and only the class of such an object counts.
    reused : whether values of the function are stored and used again. Code that finds values by a name
        unknown in advance is then refused; environment variables and modules that it names count.
    """
    return _Fingerprint(what, reused).of(value).hex()


class _Fingerprint:
    """A recursive walk through the parts of a value; an object that contains itself is entered once."""

    def __init__(self, what: str, reused: bool) -> None:
        self.what, self.reused = what, reused
        self.depths: dict[int, int] = {}
        # The object is kept, too: otherwise a later object could get the same id.
        self.known: dict[int, tuple[Any, bytes]] = {}

    def of(self, value: Any) -> bytes:
        """Return the digest of a value."""
        if isinstance(value, BY_REPR) and (type(value) in BY_REPR or not _of_user(type(value))):
            return _digest(type(value).__name__, repr(value))
        if isinstance(value, np.generic | np.ndarray) and not value.dtype.hasobject:
            array = np.asarray(value)
            extra = () if not np.ma.isMaskedArray(value) else (self.of(np.ma.getmaskarray(value)),)
            return _digest("array", array.dtype.str, repr(array.shape), array.tobytes(), *extra)
        if id(value) in self.known:
            return self.known[id(value)][1]
        if id(value) in self.depths:
            return _digest("part of itself", repr(len(self.depths) - self.depths[id(value)]))
        self.depths[id(value)] = len(self.depths)
        digest = _digest(*self.parts(value))
        del self.depths[id(value)]
        self.known[id(value)] = value, digest
        return digest

    def parts(self, value: Any) -> Iterator[bytes | str]:
        """Yield the parts of a value."""
        kind = type(value)
        yield f"{kind.__module__}.{kind.__qualname__}"
        if self.reused and (value is os.getenv or value is getattr(os, "getenvb", None)):
            raise self.refusal("getenv")
        if isinstance(value, types.FunctionType):
            yield from self.function(value)
        elif isinstance(value, functools.partial):
            yield from (self.of(part) for part in (value.func, value.args, value.keywords))
            yield from self.attributes(vars(value))
        elif isinstance(value, types.MethodType):
            yield from (self.of(value.__func__), self.of(value.__self__))
        elif isinstance(value, type | types.ModuleType | types.BuiltinFunctionType | np.ufunc):
            yield from self.named(value)
        elif isinstance(value, list | tuple | np.ndarray):
            yield from map(self.of, np.atleast_1d(value) if isinstance(value, np.ndarray) else value)
            yield from self.own(value)
        elif isinstance(value, Mapping):
            yield from self.unordered((key, item) for key, item in value.items())
            if isinstance(value, defaultdict):
                yield self.of(value.default_factory)
            yield from self.own(value)
        elif isinstance(value, set | frozenset):
            yield from self.unordered(value)
            yield from self.own(value)
        elif isinstance(value, enum.Enum):
            yield from (str(value), self.of(value.value))
        elif isinstance(value, Path):
            yield str(value)
        elif isinstance(value, BY_REPR):  # of a class of the user
            basis: Any = next(one for one in BY_REPR if isinstance(value, one))
            yield basis.__repr__(value)
            yield from self.own(value)
        elif hasattr(value, "__wrapped__"):
            if self.reused and hasattr(value, "cache_clear") and _of_user(value):
                value.cache_clear()
            yield self.of(value.__wrapped__)
            if _of_user(kind):
                yield from self.object(value)
        else:
            yield from self.object(value)

    def own(self, value: Any) -> Iterator[bytes]:
        """Yield what a user's class adds to a container or number: its members, and attributes."""
        if _of_user(type(value)):
            yield self.of(type(value))
            yield from self.attributes(getattr(value, "__dict__", {}))

    def attributes(self, given: Mapping[str, Any]) -> Iterator[bytes]:
        """Yield the attributes of an object that usually has none; nothing if there are none."""
        if more := {name: value for name, value in given.items() if name != "__wrapped__"}:
            yield self.of(more)

    def unordered(self, items: Iterable[Any]) -> Iterator[bytes]:
        """Yield the digests of items, sorted."""
        yield from sorted(map(self.of, items))

    def named(self, value: Any) -> Iterator[bytes | str]:
        """Yield the name of a class, module or built-in function; for a user's class also its members, and
        for a user's module its file."""
        yield f"{getattr(value, '__module__', '')}:{getattr(value, '__qualname__', value.__name__)}"
        if isinstance(value, type) and _of_user(value):
            yield from map(self.of, value.__bases__)
            for name, member in sorted(vars(value).items()):
                yield from self.member(name, member)
        elif isinstance(value, types.ModuleType) and _of_user(value):
            file = getattr(value, "__file__", None)
            yield sha256(Path(file).read_bytes()) if file else ""
        own = getattr(value, "__self__", None)
        if isinstance(value, types.BuiltinFunctionType) and not isinstance(own, types.ModuleType | None):
            yield self.of(own)

    def member(self, name: str, member: Any) -> Iterator[bytes | str]:
        """Yield a member of a user's class: a method, or a value that Python did not create itself."""
        function = next(
            (getattr(member, at) for at in ("__func__", "fget", "func") if hasattr(member, at)), member
        )
        if isinstance(function, types.FunctionType):
            yield from (name, self.of(function))
        elif not name.startswith(("__", "_abc_")) and not inspect.isdatadescriptor(member):
            yield from (name, self.of(member))

    def function(self, function: types.FunctionType) -> Iterator[bytes | str]:
        """Yield the parts of a function, and all values that it is bound to.

        A function of a package, which has a version, is identified by its name; a user's function by its code
        and the globals that the code names.
        """
        yield f"{function.__module__}:{function.__qualname__}"
        if hasattr(function, "__wrapped__"):
            yield self.of(function.__wrapped__)
        yield self.of(function.__defaults__)
        yield self.of(function.__kwdefaults__)
        for cell in function.__closure__ or ():
            try:
                content = cell.cell_contents
            except ValueError:
                continue  # A variable that is not set yet.
            yield self.of(content)
        if _of_user(function):
            lookups = Lookups()
            yield from self.code(function.__code__, lookups)
            yield from self.attributes(vars(function))
            if self.reused and lookups.hidden:
                raise self.refusal(min(lookups.hidden), function)
            names = lookups.names
            whole = self.reused and not names.isdisjoint(ANY_ATTRIBUTE)
            for name in sorted(names & function.__globals__.keys()):
                value = function.__globals__[name]
                if self.reused and name in ENVIRONMENT and _of_os(value):
                    continue
                yield from (name, self.of(value))
                if isinstance(value, types.ModuleType):
                    yield from self.module(value, names, whole)
            if self.reused:
                yield from self.looked_up(function, lookups, whole)

    def module(
        self, module: types.ModuleType, names: set[str], whole: bool, seen: tuple[str, ...] = ()
    ) -> Iterator[bytes | str]:
        """Yield the attributes of a user's module that code names, such as ``target`` in ``settings.target``;
        or all of them."""
        if not _of_user(module) or module.__name__ in seen:
            return
        named = [name for name in vars(module) if not name.startswith("__")] if whole else names
        for name in sorted(vars(module).keys() & named):
            value = vars(module)[name]
            yield from (name, self.of(value))
            if isinstance(value, types.ModuleType):
                yield from self.module(value, names, whole, (*seen, module.__name__))

    def looked_up(self, function: types.FunctionType, lookups: Lookups, whole: bool) -> Iterator[bytes | str]:
        """Yield the environment variables that a function reads, and the user's modules that it imports."""
        for name in sorted(lookups.variables):
            yield from (name, self.of(os.environ.get(name)))
        for name in lookups.modules(function.__globals__.get("__package__") or ""):
            if module := _imported(name):
                yield from (name, self.of(module))
                yield from self.module(module, lookups.names, whole)

    def refusal(self, received: str, function: types.FunctionType | None = None) -> InputError:
        """Return the error for code that finds values by a name unknown in advance."""
        place = "" if function is None else f" ({function.__qualname__})"
        rule = "must read values by names that its code shows"
        if received in ENVIRONMENT:
            rule = "must name each environment variable by a constant, os.environ['NAME']"
        return InputError(
            f"{self.what or 'function'} {rule}, as its values are used again; received {received}{place}. Or "
            "give Problem(code=...), a text that you change with these values"
        )

    def code(self, code: types.CodeType, lookups: Lookups) -> Iterator[bytes | str]:
        """Yield a code object without its line numbers, and add what it looks up."""
        lookups.add(code)
        yield from (code.co_code, repr(code.co_names), repr(code.co_varnames), repr(code.co_freevars))
        for constant in code.co_consts:
            if isinstance(constant, types.CodeType):
                yield from self.code(constant, lookups)
            else:
                yield self.of(constant)

    def object(self, value: Any) -> Iterator[bytes | str]:
        """Yield an object by its class and attributes; an object without attributes by its pickle."""
        yield self.of(type(value))
        if isinstance(value, BaseModel):
            # Only the fields of a model count, not values computed from them later.
            yield self.of({name: getattr(value, name) for name in type(value).model_fields})
            if _of_user(type(value)):
                yield self.of([value.__pydantic_private__, value.__pydantic_extra__])
            return
        kinds = type(value).__mro__[::-1]
        members = {name: member for kind in kinds for name, member in vars(kind).items()}
        slotted = [one for kind in kinds if "__slots__" in vars(kind) for one in vars(kind).items()]
        slots = [name for name, one in slotted if isinstance(one, types.MemberDescriptorType)]
        if (hasattr(value, "__dict__") or slots) and _plain_attributes(type(value)):
            given = {name: getattr(value, name) for name in slots if hasattr(value, name)}
            given |= getattr(value, "__dict__", {})
            for name, member in members.items():
                if isinstance(member, functools.cached_property):
                    given.pop(name, None)
                    # A value that was computed before the search may be of an old file, so it counts. It is
                    # computed if it was not yet: its fingerprint should not change when it is first used.
                    if self.reused and _of_user(type(value)):
                        with contextlib.suppress(Exception):
                            given[name] = getattr(value, name)
            yield self.of(given)
            return
        try:
            yield pickle.dumps(value, protocol=4)
        except Exception as error:
            if not self.what:
                return
            raise InputError(
                f"{self.what} must use only values that can be compared; received {abbreviated(value)} "
                f"({error}). Or give Problem(code=...), a text that you change with that value"
            ) from error


def _digest(*parts: bytes | str) -> bytes:
    """Return the SHA-256 of parts, each preceded by its length."""
    total = hashlib.sha256()
    for part in parts:
        data = part.encode(errors="surrogatepass") if isinstance(part, str) else part
        total.update(len(data).to_bytes(8, "little"))
        total.update(data)
    return total.digest()


def _plain_attributes(kind: type) -> bool:
    """Return whether all classes of an object are defined in Python, so that its attributes describe it
    completely."""
    return kind.__reduce__ is object.__reduce__ and all(
        base is object or base.__flags__ & (3 << 8) == 1 << 9 for base in kind.__mro__
    )


def _of_os(value: Any) -> bool:
    """Return whether a value is one of the means of Python to read the environment."""
    return any(value is getattr(os, name, None) for name in ENVIRONMENT)


def _imported(name: str) -> types.ModuleType | None:
    """Return a user's module that a function imports; None if it is not a user's, or cannot be imported."""
    root = name.partition(".")[0]
    if is_own(root) or root in sys.stdlib_module_names:
        return None
    try:
        found = importlib.util.find_spec(root)
        if found is None or (found.origin and _is_installed(found.origin)):
            return None
        return importlib.import_module(name)
    except Exception:
        # The function then fails too, or does without the module. Once the module can be imported, it counts,
        # and the key changes.
        return None


def _is_installed(path: str) -> bool:
    return any(Path(path).is_relative_to(folder) for folder in _installed())


def _of_user(item: Callable[..., Any] | type | types.ModuleType) -> bool:
    """Return whether a function, class or module is the user's: from a file, a notebook or a terminal, and
    not from tisim, Python or an installed package."""
    whose = item.__name__ if isinstance(item, types.ModuleType) else getattr(item, "__module__", None) or ""
    root = whose.partition(".")[0]
    if is_own(whose) or root in sys.stdlib_module_names - {"__main__"}:
        return False
    module = sys.modules.get(whose)
    path = getattr(module, "__file__", None)
    return path is None or not _is_installed(path)


@functools.cache
def _installed() -> tuple[str, ...]:
    """Return the folders that packages are installed in."""
    paths = sysconfig.get_paths()
    folders = {paths[name] for name in ("purelib", "platlib", "stdlib", "platstdlib")}
    return (*folders, *site.getsitepackages(), site.getusersitepackages())
