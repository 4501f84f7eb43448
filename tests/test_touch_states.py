"""The touch as a state machine: what a strike, a wall, a bearing, a bounce and what is held go."""

from types import SimpleNamespace

import numpy as np
import pytest

from exudyn_flexlink.engines.touching import Change, Moment, Side, Touches
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.laws import Impulse, RestitutionPenalty

SOFT, RIGID = RestitutionPenalty(1e5, 0.5), Impulse(0.5)
FACE, WALL = 0, 1  # of two contacts the second one is a wall
NO_PEAKS = SimpleNamespace(peaks=lambda *_: (0.0, 0.0))


def two(law):
    return Touches([SimpleNamespace(law=law), SimpleNamespace(law=law)], faces=1)


def told(touches, k, place=0.0, totals=(0.0, 0.0)):
    return touches.intervals(k, [(place, totals)], NO_PEAKS)


# What an event is, by gap and how far inside the face (m), and where it leads.
WAYS = {
    "a strike": (SOFT, FACE, [
        (0.0, 0.3, Change.CLOSES, Side.PRESSED), (0.0, 0.2, Change.OPENS, Side.APART)]),
    "a strike that slides off, and comes back": (SOFT, FACE, [
        (0.0, 0.3, Change.CLOSES, Side.PRESSED), (-1e-5, -1e-13, Change.SLIDES_OFF, Side.BEHIND),
        (0.0, -0.1, Change.PASSES, Side.APART), (0.0, 0.1, Change.CLOSES, Side.PRESSED)]),
    "a strike that opens near the end": (SOFT, FACE, [
        (0.0, 0.3, Change.CLOSES, Side.PRESSED), (-1e-13, 1e-10, Change.OPENS, Side.APART)]),
    "a point that goes round its face": (SOFT, FACE, [
        (0.0, -0.1, Change.PASSES, Side.BEHIND), (0.0, 0.1, Change.PASSES, Side.APART)]),
    "a wall, where the corner slides off": (SOFT, WALL, [
        (-1e-6, 0.0, Change.CLOSES, Side.PRESSED), (-1e-6, -1e-13, Change.OPENS, Side.APART)]),
    "a bearing": (SOFT, FACE, [
        (0.0, np.inf, Change.CLOSES, Side.PRESSED), (0.0, np.inf, Change.OPENS, Side.APART)]),
    "what is held slides off": (RIGID, FACE, [
        (0.0, 0.3, Change.CLOSES, Side.PRESSED), (1e-17, 1e-13, Change.SLIDES_OFF, Side.BEHIND)]),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_what_happens_leads_where_the_table_says(way):
    law, k, events = WAYS[way]
    touches = two(law)
    for gap, inside, change, side in events:
        assert touches.crossing(k, gap, inside) is change
        touches.change(k, change, Moment(0.0, inside, 0.0, (0.0, 0.0)))
        assert touches.sides[k] is side
        assert touches.pressed[k] == (side is Side.PRESSED)
        assert not touches.pressed[1 - k]


def test_a_bounce_is_an_impact_and_what_is_held_tells_its_largest_force():
    """On the polynomial through the nodes of a step, between which it may be largest."""
    touches = two(RIGID)
    impact = Interval(1.0, 1.0, impulse=2.0, peak_force=np.inf)
    touches.bounce(FACE, impact)
    assert touches.sides[FACE] is Side.APART
    touches.change(FACE, Change.CLOSES, Moment(2.0, 0.1, -0.0, (2.0, 0.0)))
    nodes = np.array([0.0, 0.057104, 0.276843, 0.583590, 0.860240, 1.0])
    press = np.stack([1 - 4 * (nodes - 0.5) ** 2, 9 + 0 * nodes], axis=-1)
    touches.note(press[None])
    first, held = told(touches, FACE, 0.1, (3.0, 0.0))
    assert first == impact
    assert held.peak_force == pytest.approx(1.0, abs=1e-3)
    assert held.impulse == 1.0
