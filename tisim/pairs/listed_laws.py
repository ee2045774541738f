"""Short-ranged laws of a sum that are computed together for a pair."""

from typing import Any


class ListedLaws:
    """These laws of a sum are computed together for each listed pair within the reach of one of them.

    placed : each law with where what it has a pair remember begins among the values of a pair. remembering :
    those that have any. reaching : the laws that act beyond contact. values : how many numbers a pair comes
    to.
    """

    def __init__(self, laws: tuple[Any, ...], begin: int, remember: bool) -> None:
        placed, self.values = [], begin
        for law in laws:
            placed.append((law, self.values))
            self.values += law.data.memory if remember else 0
        self.placed = tuple(placed)
        # Values have no room for memory where the sum may not advance it.
        self.remembering = tuple(one for one in placed if remember and one[0].data.memory)
        self.reaching = tuple(law for law in laws if law.data.reaches())
