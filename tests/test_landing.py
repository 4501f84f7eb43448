"""Steps that are made again, so that they end at an event."""

from types import SimpleNamespace

import pytest

from exudyn_flexlink.integrate.control import ErrorControl
from exudyn_flexlink.integrate.events import Event
from exudyn_flexlink.integrate.radau import ErrorTimes
from exudyn_flexlink.integrate.stepper import ImplicitStepper

FOUND = Event(0.95, "a wall is left", bends=True)


class Problem:
    """An event is found in a step of 1 s, and none that is made to it arrives there."""

    def first_event(self, _step):
        return FOUND

    def late(self, _event, step):
        return -0.09 * step.h

    def arrives(self, _event, _step):
        return False


def test_an_event_that_no_step_arrives_at_is_met_from_nearer(monkeypatch):
    """In one step, whose end is moved by little only: beyond it no other event was looked for."""
    stepper = ImplicitStepper(
        SimpleNamespace(), Problem(), ErrorControl(1e-6), ErrorTimes(0, 0), 2.0
    )
    made = []

    def step(h):
        made.append(h)
        return SimpleNamespace(t=0.0, h=h, end=h)

    monkeypatch.setattr(stepper, "_attempt", lambda _: step(1.0))
    monkeypatch.setattr(stepper, "_step", step)
    assert stepper.advance(2.0) is None
    assert made == [1.0, FOUND.time]
    assert (stepper.time, stepper.steps) == (0.0, 0)
    assert stepper.h == pytest.approx(FOUND.time / 3)


def test_a_step_that_the_user_gave_is_as_long_again_after_an_event(monkeypatch):
    """It is shorter where an event is met from nearer, and was so for the rest of the run."""
    control = ErrorControl(1e-6, fixed=1.0)
    problem = Problem()
    problem.repartition_due = lambda: False
    problem.longest = lambda _: 1e9
    stepper = ImplicitStepper(SimpleNamespace(), problem, control, ErrorTimes(0, 0), 20.0)
    monkeypatch.setattr(stepper, "at", None, raising=False)
    makes = lambda h: None if h == FOUND.time else SimpleNamespace(t=0.0, h=h, end=h)  # noqa: E731
    monkeypatch.setattr(stepper, "_step", makes)
    assert stepper.advance(20.0) is None  # no step can be made to it
    assert stepper.h == pytest.approx(FOUND.time / 3)
    assert stepper._attempt(20.0).h == pytest.approx(FOUND.time / 3)
    assert stepper.h == 1.0
