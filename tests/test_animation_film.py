"""What an animation shows: which instants, how fast, which runs, where things are and touch."""

import json
from dataclasses import replace
from math import pi

import numpy as np
import pytest
import results
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from pages_of_docs import DOCS
from physics_tools import FALLING_ROD, scene

from exudyn_flexlink.animation import FilmError, Slow, film_of
from exudyn_flexlink.animation.film import Viewpoint, zooms_of
from exudyn_flexlink.animation.picture import Picture, Place, _put_beside
from exudyn_flexlink.animation.shots import GLOW_SECONDS, SLOW_SECONDS, Shots, frames_of
from exudyn_flexlink.animation.writing import film_data
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import Anchor, anchor_position
from exudyn_flexlink.plots.drawing import spots_along
from exudyn_flexlink.plots.frame import ENGINE_COLOURS
from exudyn_flexlink.plots.outline import faces
from exudyn_flexlink.result import Interval, Intervals, MeasuredError

TURN = 2 * pi / results.SPEED  # s
LATE = MeasuredError(("link.end",), limit=1e-6, largest=1.3e-4, exceeds_from=1.2)


@pytest.fixture(scope="module")
def run():
    return results.rigid_link(samples=801)


def test_two_runs_have_the_colours_of_their_engines_and_end_together(run):
    other = replace(results.rigid_link(turns=2.0, samples=201), engine="lagrangian")
    film = film_of(run, other)
    assert film.end == pytest.approx(2 * TURN)
    assert [take.colour for take in film.takes] == [
        ENGINE_COLOURS["exudyn"],
        ENGINE_COLOURS["lagrangian"],
    ]
    alike = film_of(run, run)
    assert len({take.colour for take in alike.takes} - set(ENGINE_COLOURS.values())) == 2
    assert [take.name for take in alike.takes] == ["exudyn (first)", "exudyn (second)"]


def test_a_film_of_a_doubtful_run_says_so(run):
    doubtful, words = replace(run, error=LATE), "from t = 1.2 s on maybe off by more than 1e-06 m"
    sure = replace(run, engine="lagrangian", warnings=())
    for film, told in ((film_of(doubtful), words), (film_of(doubtful, sure), f"exudyn: {words}")):
        assert film_data(film)["doubts"] == told
        picture = Picture(film, frames_of(film, 1.0, 1.0), 400)
        shown = [text.get_text().replace("\n", " ") for text in picture.axes.texts]
        assert told in shown
    assert not film_data(film_of(sure))["doubts"]


def test_what_a_stage_takes_away_or_adds_is_seen_while_it_exists():
    tie = "{type: linear, points: [ground, rod.tip], stiffness: 1, at: [1, 0]}"
    stages = f"[{{until: t - 0.1, remove: [joints.pin], add: {{springs: {{tie: {tie}}}}}}}]"
    staged = scene(FALLING_ROD, "run.duration=0.3", f"stages={stages}")
    film = film_of(simulate(staged, measure=False))
    (take,) = film.takes
    data = film_data(film)["takes"][0]
    begin = pytest.approx(0.1)
    assert [mark["spans"] for mark in data["marks"]] == [[[None, begin]]]
    spans = {line["name"]: line["spans"] for line in data["lines"]}
    assert spans == {"rod": [[None, begin], [begin, None]], "tie": [[begin, None]]}
    (pin,) = take.marks
    assert [take.exists(pin, time) for time in (0.0, 0.05, 0.2)] == [True, True, False]


def test_slow_motion_is_around_the_strike_that_was_asked_for(run, tilting):
    [first] = film_of(run, slow=Slow("strike", 1)).slow
    [second] = film_of(run, slow=Slow("strike", 2)).slow
    for own, strike in ((first, 0.5 * TURN), (second, 2.5 * TURN)):
        assert own.begin < strike < strike + 0.004 < own.end
        assert own.end - own.begin < 0.1 * TURN
    assert film_of(run, slow=Slow("strike")).slow == (first, second)
    # Of a joint with clearance: the touches; the first begins in lap 2.
    [touch] = film_of(tilting, slow=Slow("sleeve", 1)).slow
    assert touch.begin < tilting.sleeves["sleeve"].touches.begin[0] < touch.end
    with pytest.raises(FilmError, match="no contact or joint with clearance 'strike'"):
        film_of(tilting, slow=Slow("strike"))


def test_slow_motion_lasts_its_seconds_and_the_rest_is_as_fast_as_before(run):
    film = film_of(run, window=(0.0, 1.0), slow=Slow("strike", 1))
    [own] = film.slow
    frames = frames_of(film, fps=25, speed=0.1)
    inside = (frames.times > own.begin) & (frames.times < own.end)
    assert np.count_nonzero(inside) == pytest.approx(25 * SLOW_SECONDS, abs=2)
    length = own.end - own.begin
    assert frames.speeds[inside] == pytest.approx(length / SLOW_SECONDS)
    assert len(frames.times) == pytest.approx(25 * ((1 - length) / 0.1 + SLOW_SECONDS), abs=2)


def test_a_touch_glows_while_it_lasts_and_fades_after(run):
    film = film_of(run)
    speed = 0.05
    shots = Shots(film, film.takes[0], frames_of(film, 100, speed))
    times = shots.frames.times
    touches = run.contacts["strike"].touches
    shown = np.array([len(shots.glows(i)) for i in range(len(times))])
    fades = GLOW_SECONDS * speed
    expected = sum(
        (times >= b) & (times < e + fades) for b, e in zip(touches.begin, touches.end, strict=True)
    )
    assert np.array_equal(shown, expected)
    during = int(np.searchsorted(times, touches.begin[0], side="right"))
    [glow] = shots.glows(during)
    assert (glow.fresh, glow.strength) == (1.0, touches.peak_force[0] / film.largest[0])
    assert glow.place == pytest.approx(
        results.exact_s(run.scene, times[during : during + 1])[0], abs=1e-6
    )
    assert glow.text == f"{touches.peak_force[0]:#.3g} N"
    [after] = shots.glows(int(np.searchsorted(times, touches.end[0], side="right")))
    assert after.text == f"0 N, was {touches.peak_force[0]:#.3g} N"


def test_an_impact_is_told_by_its_impulse(run):
    struck = Interval(0.3, 0.3, impulse=0.01, peak_force=np.inf)
    strike = replace(run.contacts["strike"], touches=Intervals.of([struck]))
    hit = replace(run, contacts={"strike": strike})
    film = film_of(hit, window=(0.2, 0.4))
    shots = Shots(film, film.takes[0], frames_of(film, 100, 0.05))
    at = int(np.searchsorted(shots.frames.times, 0.3)) + 1
    [glow] = shots.glows(at)
    assert (glow.text, glow.strength) == ("0.0100 N s", 1.0)


def test_stops_are_shown_larger_and_torques_are_told_as_such():
    model = load_scene(DOCS / "reference/examples/stops.yaml", [
        "run.duration=0.32", "accuracy.tolerance=1e-4",
    ])  # fmt: skip
    run = simulate(model, measure=False)
    film = film_of(run)
    shots = Shots(film, film.takes[0], frames_of(film, 100, 0.05))
    assert list(shots.zooms) == ["guide.from", "buffer"]
    at = int(np.searchsorted(shots.frames.times, run.intervals["knuckle.from"].begin[0])) + 1
    [told] = [glow.text for glow in shots.glows(at) if glow.name == "knuckle.from"]
    assert told.endswith(" N m")
    assert '"unit": "N m"' in json.dumps(film_data(film))


# --- zooms ----------------------------------------------------------------------------------------


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
    monkeypatch.setattr(
        "exudyn_flexlink.animation.film.faces", lambda _: [replace(face, side=side)]
    )
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


def test_a_number_beside_a_touch_keeps_off_lines_names_and_other_numbers():
    figure = Figure((4, 4), 100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, 400)
    axes.set_ylim(0, 400)
    place = Place(axes, 1.0)
    at = np.array([200.0, 200.0])
    lines = [
        [(0, 200), (400, 187)],
        [(215, 0), (215, 180)],
    ]  # a link, and a wall
    spots = np.concatenate([spots_along(np.array(line, dtype=float), 1.0) for line in lines])
    boxes = []
    for _ in range(2):
        number = place.write("12.3 N", at, (0, 0), 13, va="center", ha="center")
        box = _put_beside(place, number, 10.0, spots)
        assert box.count_contains(spots) == 0
        assert box.y1 < 200  # names are above
        assert number.get_window_extent().bounds == pytest.approx(box.bounds, abs=1.0)
        boxes.append(box)
        spots = np.concatenate([spots, spots_along(box.padded(-1).corners()[[0, 2, 3, 1]], 1.0)])
    assert not boxes[0].padded(-1).overlaps(boxes[1])
