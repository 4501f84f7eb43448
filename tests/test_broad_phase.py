"""Pairs of link and guide that may touch soon, against gaps and rates of the mechanism itself."""

import numpy as np
import pytest
from cli_runs import ROOT

from exudyn_flexlink import load_scene
from exudyn_flexlink.engines.exudyn.redundant.contacts import BESIDE, BroadPhase
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import ContactShapes, approach, poses_of


def gaps(faces, q, v):
    """Gap, place, rate of the gap and slip of every pair, (4, pairs)."""
    seen = [approach(face, q, v, 0.0) for face in faces]
    return np.array([(at.gap, at.place, at.gap_rate, at.slip) for at in seen]).T


@pytest.mark.parametrize("model", ["clearance.yaml", "supported.yaml"])
def test_near_are_pairs_whose_gaps_close_over_their_faces(model):
    """Of 30 random motions: nothing that may touch is left out, nothing else is named."""
    assembly = assemble_scene(load_scene(ROOT / "models" / model))
    faces = assembly.mechanism.channels[0].contacts
    held = np.array([face.side == 0 for face in faces])
    length = np.array([face.length for face in faces])
    random, named = np.random.default_rng(1), 0
    for ahead in np.geomspace(1e-5, 1e-2, 30):
        q = assembly.state.q + 1e-3 * random.standard_normal(assembly.state.q.shape)
        before, v = (random.standard_normal(q.shape) for _ in range(2))
        step = 0.3 * ahead
        broad_phase = BroadPhase(faces)
        shapes = ContactShapes(faces)
        broad_phase.near(shapes.seen(poses_of(q, before, 0.0)), 0.0, 1)
        near = broad_phase.near(shapes.seen(poses_of(q, v, 0.0)), step, ahead)

        gap, place, rate, slip = gaps(faces, q, v)
        bend = (rate - gaps(faces, q, before)[2]) / step
        least = gap + ahead * np.minimum(rate, 0) + ahead**2 / 2 * np.minimum(bend, 0)
        low, high = (f(place, place + ahead * slip) for f in (np.minimum, np.maximum))
        over = (high >= -BESIDE * length) & (low <= (1 + BESIDE) * length)
        expected = np.flatnonzero(over & ((least <= 0) | held))
        assert near.tolist() == expected.tolist()
        named += len(near)
    assert 0 < named < 30 * len(faces)
