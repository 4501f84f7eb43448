"""What follows from a frozen object alone is found once, and goes with the object."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink import load_scene, loading
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.once import hand_on, once_for_each

PAPER = Path(__file__).parent.parent / "models" / "no_clearance.yaml"


class Thing:
    """Anything that can be told by its identity."""


def test_what_follows_from_an_object_is_found_once_for_each():
    calls = []

    @once_for_each
    def found(thing):
        calls.append(thing)
        return [len(calls)]

    one, other = Thing(), Thing()
    assert found(one) is found(one)
    assert found(other) is not found(one)
    assert calls == [one, other]


def test_what_was_found_holds_for_an_equal_object():
    found = once_for_each(lambda _: Thing())
    one, equal = Thing(), Thing()
    known = found(one)
    hand_on(one, equal)
    del one
    gc.collect()
    assert found(equal) is known


def test_an_error_is_not_kept():
    outcomes = iter([ValueError("not yet"), 5])

    @once_for_each
    def found(_):
        outcome = next(outcomes)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    one = Thing()
    with pytest.raises(ValueError, match="not yet"):
        found(one)
    assert found(one) == 5


def test_a_mechanism_goes_with_its_scene():
    scene = load_scene(PAPER)
    mechanism = weakref.ref(build_mechanism(scene))
    assert mechanism() is not None
    del scene
    gc.collect()
    assert mechanism() is None


def test_a_scene_that_was_loaded_is_put_together_already(monkeypatch):
    scene = load_scene(PAPER)
    monkeypatch.setattr(loading, "assemble", lambda *_: pytest.fail("put together once more"))
    assembly = loading.assemble_scene(scene)
    with pytest.raises(ValueError, match="read-only"):
        assembly.state.q[0, 0] = 1.0
    assert np.isfinite(assembly.state.q).all()
