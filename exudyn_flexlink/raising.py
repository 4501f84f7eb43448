"""Exceptions that survive being sent from one process to another."""

from __future__ import annotations

from typing import Any


class Sendable(BaseException):
    """An exception that `pickle` restores exactly, whatever arguments its `__init__` takes."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how `pickle` restores it."""
        return _again, (type(self), self.args, self.__dict__)


def _again(
    kind: type[BaseException], args: tuple[Any, ...], state: dict[str, Any]
) -> BaseException:
    made = kind.__new__(kind)
    made.args = args
    made.__dict__.update(state)
    return made
