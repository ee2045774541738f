"""Memory for lists of different lengths, so that scenes that differ in these alone run as one batch."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tisim.scene.scene import Scene

Rooms = Mapping[str, Mapping[str, int]]
"""Rows in the memory of each list by its name, for each effect by its label."""
UNLIMITED = 1 << 40
"""More rows than any list has."""
SPARE_NUMBERS = 64_000_000
"""Numbers in the lists of a batch, half a gigabyte, up to which scenes always share their memory."""
WASTED_ROOM = 2.0
"""Ratio of the numbers in memory to the needed ones up to which larger batches share their memory."""
KEPT_STRUCTURES, KEPT_ROOMS = 64, 8
"""Structures whose rooms are kept for later batches, and rooms of each."""


class SharedRooms:
    """Gives scenes that differ only in the lengths of lists memory for the longest of each list.

    A room is kept for later batches, so that a search compiles few simulations.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict[Any, list[Rooms]] = OrderedDict()

    def scenes(self, scenes: Sequence[Scene]) -> list[Scene]:
        """Return copies of the scenes with memory for their lists. Those that differ only in the lengths of
        lists are put into few groups, each with memory for the longest of each list; there are several
        groups if too much memory would stay empty in one. Results do not depend on it."""
        alike: dict[Any, list[int]] = {}
        for index, scene in enumerate(scenes):
            alike.setdefault(_apart_from_room(scene), []).append(index)
        made = list(scenes)
        for structure, members in alike.items():
            kept = self._kept.setdefault(structure, [])
            self._kept.move_to_end(structure)
            for group, room in _groups({k: scenes[k] for k in members}):
                own = sum(scenes[k].room_size() for k in group)
                large = [one for one in kept if _holds(one, room)]
                large = [one for one in large if _fits(len(group) * _size(scenes[group[0]], one), own)]
                given = min(large, key=lambda one: _size(scenes[group[0]], one), default=room)
                if given is room:
                    kept.append(room)
                for k in group:
                    made[k] = scenes[k].with_rooms(given)
            del kept[:-KEPT_ROOMS]
        while len(self._kept) > KEPT_STRUCTURES:
            self._kept.popitem(last=False)
        return made


def _groups(scenes: Mapping[int, Scene]) -> Iterator[tuple[list[int], Rooms]]:
    """Yield groups of indices of alike scenes, the largest scenes first, and the room of each group."""
    group: list[int] = []
    room: Rooms = {}
    own = 0
    for k in sorted(scenes, key=lambda k: -scenes[k].room_size()):
        scene, size = scenes[k], scenes[k].room_size()
        larger = _larger(room, scene.rooms())
        if group and not _fits((len(group) + 1) * _size(scene, larger), own + size):
            yield group, room
            group, larger, own = [], scene.rooms(), 0
        group, room, own = [*group, k], larger, own + size
    yield group, room


def _apart_from_room(scene: Scene) -> Any:
    """Return the structure of a scene without the lengths of its lists."""
    unlimited = {label: dict.fromkeys(lists, UNLIMITED) for label, lists in scene.rooms().items()}
    return scene.with_rooms(unlimited).structure()


def _size(scene: Scene, room: Rooms) -> int:
    """Return the numbers in the lists of a scene with a room."""
    return scene.with_rooms(room).room_size()


def _fits(numbers: int, needed: int) -> bool:
    """Return whether these numbers may be in memory for the needed ones."""
    return numbers <= max(SPARE_NUMBERS, WASTED_ROOM * needed)


def _larger(one: Rooms, other: Rooms) -> Rooms:
    """Return the larger number of rows of each list of alike scenes; one : may be empty."""
    return {
        label: {name: max(rows, one.get(label, {}).get(name, 0)) for name, rows in lists.items()}
        for label, lists in other.items()
    }


def _holds(one: Rooms, other: Rooms) -> bool:
    """Return whether a room holds all lists of another one of alike scenes."""
    return all(one[label][name] >= rows for label, lists in other.items() for name, rows in lists.items())
