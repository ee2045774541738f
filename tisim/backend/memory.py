"""Device memory, in trees of fields that are allocated and freed together."""

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
"""Largest number of trees in use at once; with more than 512, Taichi 1.7.4 and Quadrants 1.3.3 crash."""

MAX_TREES_PER_START = 300
"""Trees after which Taichi is restarted: it never frees the memory of compiled kernels, some hundred kB per
tree, and compiles more slowly the more there are."""

MOST_ENTRIES = 2**31 - 1
"""Largest number of entries of a field: the kernel compiler counts them with 32 bits."""

LISTS_PART = 0.5
"""Fraction of the memory that fields and pair lists together may take when lists grow; copies of the fields
and the compiler need the rest."""

reclaimers: list[Callable[[], None]] = []
"""Functions that free cached memory."""

_tree_counts: Counter[int] = Counter()
"""Number of trees that have been made, for each start of Taichi."""
_collecting: list[list[Tree]] = []
_live: weakref.WeakSet[Tree] = weakref.WeakSet()
_lost: deque[tuple[Any, int]] = deque()
"""Trees whose owner was garbage-collected without ``destroy``, each with its start of Taichi. They are
queued, as the garbage collector may run at any time and in any thread."""


class OutOfMemory(RunError):
    """There is not enough memory for fields.

    what : the limited quantity. rule : the limit. received : the amount needed.
    """

    def __init__(self, what: str, rule: str, received: str) -> None:
        self.what, self.rule, self.received = what, rule, received
        super().__init__(f"{what} of all fields must be {rule}; received {received}")


def require_lists(needed: int, instead_of: int) -> None:
    """Raise OutOfMemory unless there is memory for lists of this many bytes in place of existing ones."""
    there = int(LISTS_PART * runtime.memory()) - (bytes_in_use() - instead_of)
    if needed > there:
        rule = f"within the {max(there, 0) / 1e9:.3g} GB that are left for lists of pairs"
        raise OutOfMemory("memory", rule, f"{needed / 1e9:.3g} GB")


def require_memory(needed: int) -> None:
    """Raise OutOfMemory unless this process may have this many bytes of memory."""
    there = runtime.memory()
    if needed > there:
        rule = f"within the {there / 1e9:.0f} GB that this process may have"
        raise OutOfMemory("memory", rule, f"{needed / 1e9:.3g} GB")


def _require_entries(longest: int) -> None:
    if longest > MOST_ENTRIES:
        raise OutOfMemory("numbers", f"at most {MOST_ENTRIES} in each field", str(longest))


class Tree:
    """A tree holds the fields of one builder in device memory.

    It raises OutOfMemory if there is not enough memory, and RunError if too many trees are in use.
    """

    @in_taichi_thread
    def __init__(self, builder: Builder) -> None:
        sizes = list(builder.sizes())
        self.bytes = sum(entries * each for entries, each in sizes)
        try:
            require_memory(self.bytes + bytes_in_use())
            _require_entries(max((entries for entries, _ in sizes), default=0))
        except OutOfMemory:
            builder.abandon()
            raise
        # Finalised in any case: an unfinished builder would break every later kernel.
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
        """Return whether the memory still exists: it has not been freed, nor lost in a restart of Taichi."""
        return self._forget.alive and self.generation == runtime.generation()

    @in_taichi_thread
    def destroy(self) -> None:
        """Free the memory, unless this has been done already."""
        self._forget()
        _release_lost()


def in_use() -> set[Tree]:
    """Return all trees whose memory still exists."""
    return {tree for tree in _live if tree.alive}


def bytes_in_use() -> int:
    """Return the bytes of all fields that are in use."""
    return sum(tree.bytes for tree in in_use())


@contextmanager
def collected() -> Iterator[list[Tree]]:
    """Yield a list of the trees that are made in this context; if an exception is raised, they are
    destroyed."""
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
    """Return whether enough trees have been made that Taichi should be restarted."""
    return _tree_counts[runtime.generation()] >= MAX_TREES_PER_START


@in_taichi_thread
def reclaim() -> None:
    """Free unused memory: cached objects, and forgotten trees that are not garbage-collected yet."""
    for give_back in reclaimers:
        give_back()
    gc.collect()
    _release_lost()


@in_taichi_thread
def renew() -> None:
    """Restart Taichi, unless a tree is in use."""
    if not in_use():
        # Forgotten objects that are not collected yet would keep the memory alive.
        gc.collect()
        runtime.restart()


def _release_all() -> None:
    """Destroy all trees, those of earlier starts too.

    A tree holds the program of its start. On CUDA, Quadrants 1.4.0 aborts the process if the last owner of a
    program releases it outside of Taichi's thread, as the interpreter does when it ends.
    """
    for tree in list(_live):
        tree.destroy()


runtime.before_stop.append(_release_all)


def _release_lost() -> None:
    """Destroy the trees in the queue."""
    while _lost:
        tree, generation = _lost.popleft()
        if generation == runtime.generation():
            # Synchronize first: Taichi fails if it frees fields that no kernel has used and that it has not
            # seen.
            ti.sync()
            # Not tree.destroy(), which would have every kernel of all other trees compiled again.
            tree.ptr.destroy_snode_tree(tree.prog)
            tree.destroyed = True
