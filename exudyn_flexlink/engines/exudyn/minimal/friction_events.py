"""When a joint with dry friction comes to rest, or slides on, within a step.

Between two such events friction has one sign. What slides rests where its speed is zero; what rests
slides where the torque that holds it reaches its bound. The force of a slide changes sides where it
is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum, auto
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.friction import LEAST_BOUND, STILL
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel, TreeForces
from exudyn_flexlink.engines.touching import TO_LOOKS
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import POWERS
from exudyn_flexlink.integrate.events import EVENT_TIME, Event, first_fall
from exudyn_flexlink.integrate.radau import Step

Value = Callable[[TreeForces], FloatArray]
"""Event function of a joint, by what is known of the tree (n,): positive until it happens."""


class Happens(Enum):
    """What becomes of the friction in a joint."""

    RESTS = auto()  # or slides back
    SLIDES = auto()
    SWEPT_ALONG = auto()  # by a drive, from rest
    CHANGES_SIDES = auto()


class FrictionChange(NamedTuple):
    """It happens to friction number `joint`."""

    joint: int
    what: Happens


class FrictionWatch:
    """Looks at the steps of a model, and tells its friction what happens."""

    def __init__(self, model: MinimalModel) -> None:
        self._model, self._own = model, model.frictions

    def settle(self, time: float, q: FloatArray, v: FloatArray) -> None:
        """Let joints slide or rest as the present state tells: speeds or forces may have jumped."""
        if self._own.all:
            states = self._model.states(np.array([time]), q[None], v[None])
            inside = self._model.window.all_inside(np.array([time]))
            self._own.settle(self._model.without_reactions(inside, states))

    def events(self, step: Step) -> list[Event]:
        """What happens first to each joint within a step."""
        if not self._own.all:
            return []
        known = [step.begin.kept.pick(None), step.stages.kept]
        found = []
        for what, value in self._values(step):
            at_nodes = np.concatenate([value(own) for own in known])
            if (TO_LOOKS @ at_nodes)[1:].min() > 0:
                continue
            slope = Polynomial(POWERS @ at_nodes).deriv()
            time = first_fall(
                lambda t, value=value: self._at(step, value, t),  # type: ignore[misc]
                lambda t, slope=slope: float(slope((t - step.t) / step.h)),  # type: ignore[misc]
                (step.t, step.end),
            )
            if time is not None:
                bends = what.what in (Happens.SLIDES, Happens.CHANGES_SIDES)
                found.append(Event(time, what, bends))
        return found

    def _values(self, step: Step) -> Iterator[tuple[FrictionChange, Value]]:
        """Event functions of what may happen to each joint, as it slides or rests now."""
        own, rows = self._own, self._own.rows
        driven = own.driven(step.begin.kept.state)
        for k, way in enumerate(own.way.tolist()):
            if way:
                yield FrictionChange(k, Happens.RESTS), _speed(rows[k], way, own.since[k])
            elif driven[k]:
                yield FrictionChange(k, Happens.SWEPT_ALONG), _stillness(rows[k])
            else:
                yield FrictionChange(k, Happens.SLIDES), _left_of_bound(k)
        for k in own.has_sides.tolist():
            if own.way[k]:
                yield FrictionChange(k, Happens.CHANGES_SIDES), _press(k, own.side[k])

    def _at(self, step: Step, value: Value, t: float) -> float:
        q, v = step.at(np.array([t]))
        return float(value(self._model.evaluate(t, q[0], v[0]).kept.pick(None))[0])

    def late(self, change: FrictionChange, step: Step) -> float:
        """How long (s) before a step's end a joint came to rest; negative: after; else 0."""
        if change.what is not Happens.RESTS:
            return 0.0
        row = self._own.rows[change.joint]
        q, v = step.finish.q, step.finish.v
        state = self._model.state(step.end, q, v)
        speed = row @ state.v - self._own.since[change.joint]
        slope = row @ (state.b + state.transform.expanded(step.finish.a))
        near = abs(speed) <= abs(slope) * instant(step.end, EVENT_TIME)
        return 0.0 if near or slope == 0 else float(speed / slope)

    def cross(self, time: float, change: FrictionChange) -> None:
        """Let it happen; what comes to rest, or is swept along, does so as equations restart."""
        k = change.joint
        if change.what is Happens.SLIDES:
            at = self._model.evaluate(time, *self._model.coordinates.independent())
            self._own.slide(k, at.kept.friction, at.kept.state.v)
        elif change.what is Happens.RESTS:
            self._own.stopped = k
        elif change.what is Happens.CHANGES_SIDES:
            self._own.side = np.where(np.arange(len(self._own.all)) == k, -1, 1) * self._own.side


def _speed(row: FloatArray, way: float, since: float) -> Value:
    return lambda at: np.asarray(way * (at.state.v @ row - since))


def _stillness(row: FloatArray) -> Value:
    return lambda at: np.asarray(STILL - np.abs(at.state.v @ row))


def _left_of_bound(k: int) -> Value:
    """Part of the bound that is left to a joint at rest."""

    def left(at: TreeForces) -> FloatArray:
        torque, bound = at.friction[:, k, 0], at.friction[:, k, 1]
        return np.asarray(1.0 - np.abs(torque) / np.maximum(bound, LEAST_BOUND))

    return left


def _press(k: int, side: float) -> Value:
    return lambda at: np.asarray(side * at.friction[:, k, 2])
