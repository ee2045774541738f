"""Memory for lists of different lengths, so that scenes that differ in these alone run as one batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tisim.scene.scene import Scene

Room = tuple[Mapping[str, int], ...]
"""Rows in the memory of each list, by name, for each effect of a scene."""
UNLIMITED = 1 << 40
"""More rows than any list has."""
SPARE_ROWS = 16_000_000
"""Rows of a batch that may be in memory without need: half a gigabyte of the cells of a flow."""
WASTED_ROOM = 2.0
"""Rows in memory, over those that are needed, up to which larger batches share their memory."""


class SharedRooms:
    """The room that scenes get which differ in the lengths of lists alone; it grows from batch to batch, so
    that a search compiles few simulations."""

    def __init__(self) -> None:
        self._given: dict[Any, Room] = {}

    def scenes(self, scenes: Sequence[Scene]) -> list[Scene]:
        """Return the scenes with the room of the largest ones of a structure, unless too much memory would
        be left empty. Results do not depend on it."""
        groups: dict[Any, list[int]] = {}
        for index, scene in enumerate(scenes):
            groups.setdefault(_apart_from_room(scene), []).append(index)
        made = list(scenes)
        for structure, members in groups.items():
            needed = [scenes[k].rooms() for k in members]
            own = sum(rows(one) for one in needed)
            given = [self._given[structure]] if structure in self._given else []
            for room in (_largest([*needed, *given]), _largest(needed)):
                if len(members) * rows(room) <= max(SPARE_ROWS, WASTED_ROOM * own):
                    self._given[structure] = room
                    for k in members:
                        made[k] = scenes[k].with_rooms(room)
                    break
        return made


def _apart_from_room(scene: Scene) -> Any:
    """Return the structure of a scene without the lengths of its lists."""
    return scene.with_rooms([dict.fromkeys(one, UNLIMITED) for one in scene.rooms()]).structure()


def _largest(rooms: Sequence[Room]) -> Room:
    return tuple(
        {name: max(one[name] for one in each) for name in each[0]} for each in zip(*rooms, strict=True)
    )


def rows(room: Room) -> int:
    """Return the number of rows in all lists."""
    return sum(sum(one.values()) for one in room)
