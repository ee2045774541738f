"""A folder that is watched, whatever is written into it: a search, a study of costs, or a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from tisim.files import regular_file
from tisim.watch.watched import Watched

Kind = Literal["search", "cost", "run"]


def kind_of(path: Path) -> Kind:
    """Return what a folder, or one of its files, belongs to. An empty folder is that of a run."""
    if path.name == "search.h5" or _has(path, "search.h5", "search.h5.journal"):
        return "search"
    return "cost" if path.name == "cost.h5" or _has(path, "cost.h5") else "run"


def _has(path: Path, *names: str) -> bool:
    return any(regular_file.exists(path / name) for name in names)


class WatchedFolder(Watched):
    """A folder that is watched, or one of its files; its ``answers`` are for a ``WatchServer``.

    The files tell the kind of the folder. Until there are files, it is watched as the folder of a run: a
    study of costs writes its first file after the runs of the reference.
    """

    def __init__(self, path: Path, begin: Callable[[Kind], Watched]) -> None:
        """begin : returns what is watched in a folder of a kind."""
        self._path, self._begin = path, begin
        self._kind = kind_of(path)
        self._current = begin(self._kind)

    def _changed(self) -> bool:
        """Look for files again; return whether the folder is of another kind than was known."""
        kind = kind_of(self._path)
        if kind == self._kind:
            return False
        self._kind, self._current = kind, self._begin(kind)
        return True

    def page(self) -> str:
        self._changed()
        return self._current.page()

    def news(self, query: Mapping[str, str]) -> dict[str, Any]:
        return {"reload": True} if self._changed() else self._current.news(query)
