"""Contacts whose force is a table: between two rows a piece is followed to its end."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import SpringDamper, SpringTable


class TableFollower:
    """Follows the depth (m) of a contact, by coordinates of the tree, from row to row."""

    def __init__(self, depth: Callable[[FloatArray], float], name: str, table: SpringTable) -> None:
        self._depth, self.name, self._table = depth, name, table
        self.number: int | None = None  # of the piece, while the contact presses

    def follow(self, depth: float | None) -> None:
        """Follow the piece of a depth (m) from here on, if none is; None: nothing presses."""
        if depth is None or self.number is None:
            self.number = None if depth is None else self._table.number(depth)

    def law(self, depth: float) -> SpringDamper:
        """Law of the piece that is followed; while nothing presses, of that of a depth (m)."""
        own = self._table.number(depth) if self.number is None else self.number
        return self._table.piece(own)

    def left(self, x: FloatArray, _: FloatArray) -> tuple[float, float]:
        """How far (m) the depth is from the end and the start of the piece."""
        assert self.number is not None  # only what presses comes to a piece's end
        depth, depths = self._depth(x), self._table.depths
        behind = depth - depths[self.number] if self.number else inf
        return depths[self.number + 1] - depth, behind

    def next_piece(self, way: int) -> bool:
        """Go on along the next piece (way 1), or the one before (-1); False if there is none."""
        assert self.number is not None  # only what presses comes to a piece's end
        self.number += way
        return self.number < len(self._table.depths) - 1
