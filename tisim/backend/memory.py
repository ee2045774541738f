"""Device memory: fields that are made together, and go together."""

from __future__ import annotations

import gc
import weakref
from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.errors import RunError

MAX_TREES = 480
"""So many trees of fields may be in use at once; with more than 512, Taichi 1.7.4 and Quadrants 1.3.3
crash."""

MAX_TREES_PER_START = 300
"""Taichi is started anew after so many trees: it never gives back the memory of compiled kernels, some
hundred kB to each tree, and takes longer to compile the more there are."""

MOST_ENTRIES = 2**31 - 1
"""A field has at most so many numbers: the kernel compiler counts them with 32 bits."""

LISTS_PART = 0.5
"""Fields and lists of pairs together may take this part of the memory, where lists are to grow; copies of the
fields and the compiler need the rest."""

reclaimers: list[Callable[[], None]] = []
"""These functions give back memory that is kept for later only."""

_tree_counts: Counter[int] = Counter()
"""This counts the trees that have been made, by the start of Taichi."""
_collecting: list[list[Tree]] = []
_live: weakref.WeakSet[Tree] = weakref.WeakSet()
_lost: deque[tuple[Any, int]] = deque()
"""These are the trees whose owner has been forgotten without ``destroy``, each with the start of Taichi it
belongs to. It is a list, as the garbage collector may come at any time and in any thread."""


class NoRoom(RunError):
    """There is no room for fields: ``what`` they need of it must be as ``rule`` says; it is ``received``."""

    def __init__(self, what: str, rule: str, received: str) -> None:
        self.what, self.rule, self.received = what, rule, received
        super().__init__(f"{what} of all fields must be {rule}; received {received}")


def require_lists(needed: int, instead_of: int) -> None:
    """Raise NoRoom unless there is room for lists of so many bytes, in place of some that are there."""
    there = int(LISTS_PART * runtime.memory()) - (bytes_in_use() - instead_of)
    if needed > there:
        rule = f"within the {max(there, 0) / 1e9:.3g} GB that are left for lists of pairs"
        raise NoRoom("memory", rule, f"{needed / 1e9:.3g} GB")


def require_memory(needed: int) -> None:
    """Raise NoRoom unless this machine has so many bytes of memory."""
    there = runtime.memory()
    if needed > there:
        rule = f"within the {there / 1e9:.0f} GB that this process may have"
        raise NoRoom("memory", rule, f"{needed / 1e9:.3g} GB")


def _require_entries(longest: int) -> None:
    if longest > MOST_ENTRIES:
        raise NoRoom("numbers", f"at most {MOST_ENTRIES} in each field", str(longest))


class Tree:
    """A tree is fields that have been placed in one builder, in device memory from now on.

    NoRoom is raised where there is none for them, RunError where too many are in use.
    """

    @in_taichi_thread
    def __init__(self, builder: Builder) -> None:
        sizes = list(builder.sizes())
        self.bytes = sum(entries * each for entries, each in sizes)
        try:
            require_memory(self.bytes + bytes_in_use())
            _require_entries(max((entries for entries, _ in sizes), default=0))
        except NoRoom:
            builder.abandon()
            raise
        # Whatever comes next: a builder that has not been finalised is a fault of every later kernel.
        tree = builder.finalize()
        self.generation = runtime.generation()
        self._forget = weakref.finalize(self, _lost.append, (tree, self.generation))
        self._forget.atexit = False
        _live.add(self)
        for trees in _collecting:
            trees.append(self)
        _tree_counts[self.generation] += 1
        _release_lost()
        if len(in_use()) > MAX_TREES:
            self.destroy()
            raise RunError(
                f"at most {MAX_TREES} sets of fields can be in use at once; close a Simulation first"
            )

    @property
    def alive(self) -> bool:
        """Return whether the memory is there: not destroyed, nor gone with a Taichi that has been started
        anew."""
        return self._forget.alive and self.generation == runtime.generation()

    @in_taichi_thread
    def destroy(self) -> None:
        """Give the memory back. Nothing is done where it has gone already."""
        self._forget()
        _release_lost()


def in_use() -> set[Tree]:
    """Return all trees whose memory is there."""
    return {tree for tree in _live if tree.alive}


def bytes_in_use() -> int:
    """Return the bytes of all fields that are in use."""
    return sum(tree.bytes for tree in in_use())


@contextmanager
def collected() -> Iterator[list[Tree]]:
    """Yield the trees that are made meanwhile, in a list; where anything is raised, they are gone."""
    trees: list[Tree] = []
    _collecting.append(trees)
    try:
        yield trees
    except BaseException:
        for tree in trees:
            tree.destroy()
        raise
    finally:
        _collecting.pop()


def tree_count() -> int:
    """Return the number of trees that have been made in this process."""
    return _tree_counts.total()


def needs_restart() -> bool:
    """Return whether so many trees have been made that Taichi should be started anew."""
    return _tree_counts[runtime.generation()] >= MAX_TREES_PER_START


@in_taichi_thread
def reclaim() -> None:
    """Give back what nobody uses: what is kept for later, and what has been forgotten, but not collected."""
    for give_back in reclaimers:
        give_back()
    gc.collect()
    _release_lost()


@in_taichi_thread
def renew() -> None:
    """Start Taichi anew, unless a tree is in use."""
    if not in_use():
        # What has been forgotten, but not yet collected, would keep alive all that this is to give back.
        gc.collect()
        runtime.restart()


def _release_lost() -> None:
    """Destroy what has been forgotten."""
    while _lost:
        tree, generation = _lost.popleft()
        if generation == runtime.generation():
            # Taichi must have seen fields that no kernel has used before they go, or it stumbles over them.
            ti.sync()
            # Not tree.destroy(), which has every kernel of all other trees compiled again, too.
            tree.ptr.destroy_snode_tree(tree.prog)
            tree.destroyed = True
