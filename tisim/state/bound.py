"""Bound parts: the objects through which kernels read a part of a scene.

``part.hardness`` is a number in Pa. ``bound.hardness`` is a function of the world, which kernels call.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tisim.backend.taichi import is_device_function
from tisim.components.component import Component

Part = TypeVar("Part", bound=Component, covariant=True)
Kind = TypeVar("Kind", bound=Component)


class Bound(Generic[Part]):
    """A bound part gives kernels access to a part of a scene in the device memory of a batch of worlds.

    In a method decorated with ``ti.func``, ``self`` is the bound object. Each parameter is a function of the
    world, ``self.hardness(w)``. A list of parts is one object for all rows: ``self.bodies.radius(w, k)``. The
    values returned by ``connect`` of the part are attributes too. Any other attribute, such as an option or a
    constant of the class, is taken from the data.

    data : the part of the scene that was compiled; its parameter values may differ from those of
        the loaded scenes.
    index : its index among the effects of the scene.
    """

    data: Part
    index: int

    def __init__(self, data: Part) -> None:
        self.data = data

    def __getattr__(self, name: str) -> Any:
        if name == "data":
            raise AttributeError(name)
        own: Any = getattr(type(self.data), name, None)
        return own.__get__(self, type(self)) if is_device_function(own) else getattr(self.data, name)

    if TYPE_CHECKING:

        def __setattr__(self, name: str, value: Any) -> None: ...


class Peers(tuple[Bound[Any], ...]):
    """Peers are the bound effects of a scene, in scene order."""

    def of(self, *kinds: type[Kind]) -> tuple[Bound[Kind], ...]:
        """Return those peers whose data is of one of these classes."""
        return tuple(effect for effect in self if isinstance(effect.data, kinds))

    def bound(self, part: Kind) -> Bound[Kind]:
        """Return the peer that was made from exactly this part."""
        return next(effect for effect in self if effect.data is part)


def connected(bound: list[Bound[Any]]) -> Peers:
    """Give each bound effect its index and the values that its ``connect`` takes from the other effects."""
    peers = Peers(bound)
    for index, effect in enumerate(peers):
        effect.index = index
        for name, value in effect.data.connect(peers).items():
            setattr(effect, name, value)
    return peers
