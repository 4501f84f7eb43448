"""Steps that are made again, so that they end at an event."""

from types import SimpleNamespace

import pytest

from exudyn_flexlink.integrate.control import ErrorControl
from exudyn_flexlink.integrate.events import Event
from exudyn_flexlink.integrate.radau import ErrorTimes
from exudyn_flexlink.integrate.stepper import ImplicitStepper

FOUND = Event(0.95, "a wall is left", bends=True)


class Problem:
    """An event is found in a step of 1 s, and seems later the nearer one comes: by rounding."""

    def first_event(self, _step):
        return FOUND

    def late(self, _event, step):
        return -0.09 * step.h


def test_no_step_to_an_event_is_longer_than_the_one_it_was_found_in(monkeypatch):
    """Beyond its end no other event was looked for: the end of a curve would be passed unseen."""
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
    assert max(made) == 1.0
    assert (stepper.time, stepper.steps) == (0.0, 0)
    assert stepper.h == pytest.approx(FOUND.time / 3)  # it is met from nearer


def test_a_step_that_the_user_gave_is_as_long_again_after_an_event(monkeypatch):
    """It is shorter where an event is met from nearer, and was so for the rest of the run."""
    control = ErrorControl(1e-6, fixed=1.0)
    problem = Problem()
    problem.repartition_due = lambda: False
    problem.longest = lambda _: 1e9
    stepper = ImplicitStepper(SimpleNamespace(), problem, control, ErrorTimes(0, 0), 20.0)
    monkeypatch.setattr(stepper, "at", None, raising=False)
    monkeypatch.setattr(stepper, "_step", lambda h: SimpleNamespace(t=0.0, h=h, end=h))
    assert stepper.advance(20.0) is None  # it can't be met in a step of 1 s
    assert stepper.h == pytest.approx(FOUND.time / 3)
    assert stepper._attempt(20.0).h == pytest.approx(FOUND.time / 3)
    assert stepper.h == 1.0
