"""Zooms: a strike is seen from the face that is struck, where it is touched."""

from dataclasses import replace

import numpy as np
import pytest
import results

from exudyn_flexlink.animation import film_of, zooms
from exudyn_flexlink.animation.zooms import Viewpoint, zooms_of
from exudyn_flexlink.mechanism import Anchor, anchor_position
from exudyn_flexlink.plots.outline import faces


@pytest.fixture(scope="module")
def run():
    return results.rigid_link(samples=801)


def zoom_of(film):
    [zoom] = zooms_of(film, film.takes[0])
    return zoom


def test_a_viewpoint_turns_and_moves_with_its_part():
    """By hand: seen from (1, 0) of a part at (2, 3), turned a quarter; the x-axis points up."""
    poses = np.array([[2.0, 3.0, np.pi / 2]])
    seen = Viewpoint(Anchor(0, 1.0, 0.0)).seen(np.array([[2.0, 6.0], [1.0, 4.0]]), poses)
    assert seen == pytest.approx(np.array([[2.0, 0.0], [0.0, 1.0]]))
    other = Viewpoint(Anchor(0, 1.0, 0.0), np.pi).seen(np.array([[2.0, 6.0]]), poses)
    assert other == pytest.approx(np.array([[-2.0, 0.0]]))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_face_lies_still_in_its_zoom_and_the_free_side_is_above(run, side, monkeypatch):
    film = film_of(run)
    [face] = faces(film.takes[0].model)
    monkeypatch.setattr(zooms, "faces", lambda _: [replace(face, side=side)])
    zoom, poses = zoom_of(film), run.poses
    ends = np.stack([anchor_position(end, poses) for end in (face.start, face.end)], axis=1)
    length = np.linalg.norm(ends[0, 1] - ends[0, 0])
    seen = zoom.view.seen(ends, poses)
    order = [0, length] if side > 0 else [length, 0]
    assert seen[..., 0] == pytest.approx(np.tile(order, (len(poses), 1)))
    assert seen[..., 1] == pytest.approx(0.0, abs=1e-12)
    left = Anchor(face.start.part, face.start.x, face.start.y + 1e-3)  # of the way to its end
    above = zoom.view.seen(anchor_position(left, poses)[:, None], poses)[..., 1]
    assert above == pytest.approx(1e-3 * side)
