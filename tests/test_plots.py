from dataclasses import replace
from functools import cache
from math import sin
from pathlib import Path

import numpy as np
import pytest
import results
from matplotlib import style
from matplotlib.colors import same_color, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.text import Text
from results import texts, words

from exudyn_flexlink import storage
from exudyn_flexlink.animation import film_of
from exudyn_flexlink.animation.picture import Picture
from exudyn_flexlink.animation.shots import frames_of
from exudyn_flexlink.cli import main
from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import State, contact_states, lever_response, strikes
from exudyn_flexlink.plots import (
    ENGINE_COLOURS,
    PRINT,
    SCREEN,
    comparison,
    coordinates,
    drawing,
    energy,
    figures,
    forces,
    guide_contact,
    lever,
    mechanism,
    motion,
    start,
)
from exudyn_flexlink.plots.drawing import Labels
from exudyn_flexlink.plots.forces import STATE_COLOURS
from exudyn_flexlink.plots.outline import pitch_circles
from exudyn_flexlink.plots.panels import DOUBT_LINE, along
from exudyn_flexlink.result import NOT_ASKED, MeasuredError
from exudyn_flexlink.shipped import model_file
from exudyn_flexlink.source import parse_document

CART = """
title: A cart that hits a stop
curves: {wall: {type: line, from: [-1, -1], to: [-1, 1]}}
bodies: {cart: {type: rigid, mass: 1, inertia: 1}}
joints: {way: {type: prismatic, points: [ground, cart.centre], at: [0, 0], axis: [1, 0]}}
contacts:
  stop: {type: point_on_curve, point: cart.centre, curve: wall, side: right,
         law: {type: impulse, restitution: 0.5}}
initial: {speeds_along: {way: -2}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.fixture(scope="module")
def drawn(rigid):
    return figures(rigid)


def written(run, style=SCREEN):
    """Draw all figures with their words, lines and labels, before layouts are final.

    The layout takes most of the time, and changes none of these.
    """
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((drawing, "settle"), (motion, "settle"), (drawing, "_name_points")):
            patch.setattr(module, name, lambda *_: None)
        return figures(run, style)


def labels(figure):
    axes = figure.axes
    return [text for one in axes for text in (one.get_xlabel(), one.get_ylabel()) if text]


# --- which figures there are


ALWAYS = ["coordinates", "mechanism", "energy", "forces"]
TURNING = ["coordinates", "polar", "lever", "mechanism", "energy", "forces", "bending"]
BEFORE_A_STRIKE = [name for name in TURNING if name != "lever"]
PLAY = ["coordinates", "polar", "mechanism", "guide_contact", "energy", "forces"]


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda rigid: rigid, TURNING),
        (lambda rigid: results.first_samples(rigid, 2), BEFORE_A_STRIKE),
        (lambda rigid: results.first_samples(rigid, 1), ["mechanism"]),
        (lambda _: results.pendulum(), ALWAYS),
        (lambda _: results.slider(), ALWAYS),
        (lambda _: results.tilting_link(), PLAY),
    ],
    ids=["the paper's", "short", "stopped at once", "pendulum", "without crank", "with clearance"],
)
def test_a_run_has_the_figures_that_show_something_with_units(make, names, rigid):
    drawn = written(make(rigid))
    assert list(drawn) == names
    for name, figure in drawn.items():
        found = labels(figure)
        assert found, name
        for label in found:
            plain = label.startswith("turns of")
            assert plain or label.rstrip().endswith(")"), f"{name}: {label}"


# --- what stands in every figure


def test_points_have_the_letters_of_the_paper_and_forces_say_where_they_act(drawn):
    told = [text.get_text() for text in texts(drawn["mechanism"])]
    # Both points of a text coincide: where the lever is struck, its end is 2 mm off the link's.
    assert {"E", "S"} <= set(told)
    assert {"guide CD", "lever BE"} <= set(told)
    named = {name for text in told if len(text) < 9 for name in text.split(", ")}
    assert named >= set("BCDEOPS")
    low, _ = drawn["polar"].axes[0].get_ylim()
    assert f"the scale begins\nat {low:g}, not at zero" in words(drawn["polar"])
    told = words(drawn["forces"])
    assert "size of the\njoint force (N)" in told
    assert "crank at guide.start" in told
    assert "pin at link.start" in told


def test_names_lie_on_no_line_and_on_no_other_name(drawn):
    axes = Figure(figsize=(4, 4)).subplots()
    axes.axis((-1, 1, -1, 1))
    corner = np.array([[-1, 0], [0, 0], [0, 1]])
    labels = Labels(axes, [corner, -corner])
    for name in ("first", "second", "third"):
        labels.write(name, np.zeros(2), np.array([0.0, 1.0]))
    boxes = [text.get_window_extent() for text in axes.texts]
    for line in (corner, -corner):
        ends = axes.transData.transform(line)
        assert not any(box.count_contains(np.linspace(*ends[k : k + 2], 200))
                       for box in boxes for k in range(2))  # fmt: skip
    lettered = [axes for axes in drawn["mechanism"].axes if axes.texts]
    for of in (boxes, *([text.get_window_extent() for text in a.texts] for a in lettered)):
        assert not any(box.overlaps(other) for i, box in enumerate(of) for other in of[:i])


def test_title_engine_and_assumptions(rigid, drawn):
    for figure in drawn.values():
        said = words(figure)
        assert rigid.scene.title in said.replace("\n", " ")
        assert "hinges 'paper', n = 10" in said
        assert "tolerance 1e-06 m; error not measured" in said
        (engine,) = (text for text in texts(figure) if text.get_text() == "engine: exudyn")
        assert same_color(engine.get_color(), ENGINE_COLOURS["exudyn"])


def test_a_failed_run_says_so_in_red(rigid):
    for figure in written(results.stopped(rigid)).values():
        (note,) = (text for text in texts(figure) if text.get_text().startswith("stopped at t"))
        assert note.get_text() == "stopped at t = 0.5 s: no convergence at the smallest step"
        assert same_color(note.get_color(), "#C00000")
    assert "stopped" not in words(energy(rigid))


LATE = MeasuredError(("link.end",), limit=1e-6, largest=1.3e-4, exceeds_from=1.2)
PARTED = replace(LATE, horizon=2.0)
DOUBTS = {
    "off": (LATE, (), "from t = 1.2 s on maybe off by more than 1e-06 m"),
    "parting": (PARTED, (), "from t = 1.2 s on maybe off by more than 1e-06 m"),
    "warning": (NOT_ASKED, ("a", "b"), "2 warnings: see the run's summary"),
    "fine": (MeasuredError(("link.end",), limit=1e-6, largest=1e-7), (), ""),
}


@cache
def doubtful(kind, style=SCREEN):
    error, warnings, _ = DOUBTS[kind]
    return written(replace(results.rigid_link(), error=error, warnings=warnings), style)


@pytest.mark.parametrize("style", [SCREEN, PRINT])
@pytest.mark.parametrize("kind", DOUBTS)
def test_a_doubtful_run_says_so_in_every_figure_in_red(kind, style):
    *_, doubt = DOUBTS[kind]
    for name, figure in doubtful(kind, style).items():
        red = [t.get_text() for t in figure.texts if same_color(t.get_color(), "#C00000")]
        assert " ".join(red) == doubt, name


def test_the_foot_has_the_error_that_is_told_not_the_one_that_was_asked_for():
    told = {
        "fine": "points off by at most 1e-7 m",
        "off": "points off by at most 1e-06 m up to t = 1.2 s, then by 0.0002 m",
        "parting": "points off by at most 1e-06 m up to t = 1.2 s, then by 0.0002 m up to t = 2 s",
    }
    for kind, foot in told.items():
        for name, figure in doubtful(kind).items():
            said = " ".join(text.get_text() for text in reversed(figure.texts))
            assert foot in said, name
            assert "tolerance" not in said, name


def test_a_line_on_axes_of_time_tells_from_when_on_a_run_is_doubtful():
    """Over the crank's turns it stands where the crank is then."""
    turns = LATE.exceeds_from * results.SPEED / (2 * np.pi)
    drawn = doubtful("off")
    places = {
        "energy": (LATE.exceeds_from, 2),
        "lever": (LATE.exceeds_from, 1),
        "forces": (turns, 5),
    }
    for name, (place, panels) in places.items():
        marks = [
            line.get_xdata()[0]
            for axes in drawn[name].axes
            for line in axes.lines
            if same_color(line.get_color(), DOUBT_LINE["color"])
        ]
        assert marks == pytest.approx([place] * panels), name
        assert "may be off by\nmore than asked" in words(drawn[name])


# --- whatever the user's matplotlib looks like


def drawn_with(look, rigid, tilting):
    """Draw every figure, and a frame of a film, while a style of matplotlib's is in use."""
    scene, film = rigid.scene, film_of(tilting)
    with style.context(look):
        drawn = {
            **figures(rigid),
            "guide_contact": guide_contact(tilting),
            "start": start(scene, assemble_scene(scene)),
            "comparison": comparison(compare(rigid, replace(rigid, engine="lagrangian"))),
        }
        for figure in drawn.values():
            figure.draw_without_rendering()
        return drawn, Picture(film, frames_of(film, 1.0, 1.0), 160).frame(0)


def looks_of(figure):
    """Words, lines and pages of a figure with their colours and sizes."""
    return [
        *(
            (text.get_text(), to_hex(text.get_color()), text.get_fontsize())
            for text in texts(figure)
        ),
        *((to_hex(x.get_color()), x.get_linewidth()) for x in figure.findobj(Line2D)),
        *(to_hex(axes.get_facecolor()) for axes in figure.axes),
    ]


def test_figures_look_the_same_whatever_style_is_in_use(rigid, tilting):
    """Of three styles in use together, one is a file, such as a matplotlibrc."""
    Path("own.mplstyle").write_text("text.color: white\nfont.size: 4\nlines.linewidth: 9\n")
    looks = ["ggplot", "dark_background", "./own.mplstyle"]
    usual = drawn_with("default", rigid, tilting)
    drawn, frame = drawn_with(looks, rigid, tilting)
    for name, figure in usual[0].items():
        assert looks_of(drawn[name]) == looks_of(figure), name
    assert np.array_equal(frame, usual[1])


def test_a_figure_that_its_user_writes_has_a_white_page_whatever_is_usual(rigid):
    with style.context({"savefig.facecolor": "black"}):
        lever(rigid).savefig(Path("lever.png"))
    assert np.all(imread("lever.png")[0, 0] == 1)


def test_in_dark_axes_of_the_users_nothing_is_drawn_in_black(rigid):
    with style.context("dark_background"):
        for draw in (lever, energy, forces, coordinates, mechanism):
            figure = draw(rigid, ax=Figure().subplots())
            figure.draw_without_rendering()
            colours = [own.get_color() for kind in (Line2D, Text) for own in figure.findobj(kind)]
            assert not [colour for colour in colours if max(to_rgb(colour)) < 0.3]


# --- long names


def test_a_name_of_300_letters_leaves_a_figure_its_room():
    run = simulate(results.scene_from(CART.replace("cart", "c" * 300)), measure=False)
    drawn = {**figures(run), "start": start(run.scene, assemble_scene(run.scene))}
    for name, figure in drawn.items():
        figure.draw_without_rendering()
        assert all(axes.get_position().width > 0.2 for axes in figure.axes), name
        told = set(texts(figure)) - set(figure.texts)  # these are wrapped
        assert not [word for one in told for word in one.get_text().split() if len(word) > 40], name


# --- what stands in some


@pytest.mark.parametrize("model", ["textbook/friction_wheels", "hard/start_in_contact"])
def test_levers_that_turn_about_their_middle_or_are_struck_at_the_start(model):
    run = simulate(load_scene(model_file(model), ["run.duration=0.06"]), measure=False)
    assert "first touch of the strike" in words(lever(run))


def test_lever_marks_strikes_and_peaks(rigid):
    said = words(lever(rigid))
    assert "strike 2 (lap 3)" in said
    assert "tip displacement (mm)" in said
    assert "turns of the crank" in said
    angle, _ = lever_response(rigid, "strike").least
    tip = 30 * sin(angle)  # mm, of a lever 30 mm long
    peak = f"{angle:.4f} rad ({tip:.3f} mm)".replace("-", "\N{MINUS SIGN}")
    assert peak in said


def test_numbers_of_a_levers_peaks_stand_off_its_strikes_and_its_line(rigid):
    figure = lever(rigid)
    axes, response = figure.axes[0], lever_response(rigid, "strike")
    line = axes.transData.transform(np.stack([response.time, response.value], axis=1))
    edges = axes.transData.transform([(strike.begin, 0) for strike in strikes(rigid, "strike")])
    texts = [text.get_window_extent() for text in axes.texts]
    assert len(texts) == 2
    for box in texts:
        assert not any(box.containsx(x) for x, _ in edges)
        assert box.count_contains(line) == 0


def test_few_digits_of_a_peak_stand_with_their_error(rigid):
    coarse = replace(rigid, error=MeasuredError(("link.end",), limit=1e-4, largest=1e-4))
    least, _ = lever_response(rigid, "strike").least
    told = f"{least:.3f} \N{PLUS-MINUS SIGN} 0.004 rad".replace("-", "\N{MINUS SIGN}")
    assert told in words(lever(coarse))  # 0.1 mm at the end of a lever 30 mm long


def test_a_body_that_is_held_still_shows_no_response():
    press = simulate(load_scene(model_file("textbook/toggle_press")), measure=False)
    assert len(press.contacts["press"].touches.begin) == 1
    assert lever(press) is None
    assert "farthest" not in words(mechanism(press))


def test_a_cart_that_hits_a_stop_has_neither_a_pivot_nor_a_force_of_impacts_without_duration():
    """The line at zero that a rigid contact would have looks as if nothing had been struck."""
    cart = simulate(results.scene_from(CART), measure=False)
    assert len(cart.contacts["stop"].touches.begin) == 1
    assert "contact force" not in words(forces(cart))
    assert "pivot on the ground" not in words(mechanism(cart))
    assert "pivot on the ground" in words(mechanism(results.pendulum()))


# --- a link with clearance in its guide


def strip_of(result):
    """Bars of the strip, by row: begin, end, colour."""
    upper, axes = coordinates(result).axes
    assert upper.get_shared_x_axes().joined(upper, axes)
    return axes, [
        [(*path.get_extents().intervalx, colour) for path, colour in zip(
            bars.get_paths(), bars.get_facecolors(), strict=True)]
        for bars in axes.collections
    ]  # fmt: skip


def test_a_strip_under_the_coordinates_shows_the_states_of_each_lap(tilting):
    axes, rows = strip_of(tilting)
    assert [text.get_text() for text in axes.get_yticklabels()] == [f"lap {n}" for n in range(1, 5)]
    states, lap = contact_states(tilting, "sleeve"), 2 * np.pi / results.SPEED
    for k, row in enumerate(rows):
        found = {s: sum(b - a for a, b, c in row if same_color(c, STATE_COLOURS[s])) for s in State}
        parts = states.fractions(k * lap, (k + 1) * lap)
        wanted = {state: 2 * np.pi * part for state, part in parts.items()}
        assert found == pytest.approx(wanted, abs=2e-3)
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["free", "one point", "two, same side", "two, opposite"]


def test_the_link_in_its_guide_on_no_one_and_two_points(tilting):
    figure = guide_contact(tilting)
    assert [len(marked(axes)) for axes in figure.axes] == [0, 1, 2]
    said = words(figure)
    for word in ("free: t = ", "one point: t = ", "two points, ", "°\n", " N\n"):
        assert word in said
    for axes in figure.axes:
        walls = [line for line in axes.lines if line.get_label() == "walls"]
        assert sorted(line.get_ydata()[0] for line in walls) == [-1.0, 1.0]  # mm
        assert all(list(line.get_xdata()) == [0.0, 90.0] for line in walls)


def marked(axes):
    return [line for line in axes.lines if line.get_label() == "contact, force on the link"]


# --- odd, but sound results -----------------------------------------------------------------------


@pytest.mark.filterwarnings("error")
def test_what_does_not_move_and_has_an_odd_title_is_drawn(rigid, capsys):
    """And nothing is said: letters without a font are no warning of matplotlib's either."""
    still = replace(rigid, poses=0 * rigid.poses, rates=0 * rigid.rates)
    odd = TITLES["no formula"] + TITLES["letters without a font"]
    storage.save(results.retitled(still, odd), Path("run"))
    assert main(["plot", "run", "--out", "figures"]) == 0
    assert capsys.readouterr().err == ""
    assert len(list(Path("figures").glob("*.png"))) >= 4


TITLES = {
    "one long word": "x" * 3000,
    "many words": "word " * 3000,
    "the widest letters": "W" * 88,
    "no formula": r"costs $5, and $\\foo{$ 6",
    "letters without a font": "\u6a5f\u69cb" * 60,
}


@pytest.mark.parametrize("title", TITLES)
@pytest.mark.filterwarnings("ignore:Glyph")
def test_any_title_is_wrapped_into_the_figure(title, rigid):
    figure = energy(results.retitled(rigid, TITLES[title]))
    assert figure.get_figheight() < energy(rigid).get_figheight() + 1
    figure.draw_without_rendering()
    width = figure.get_figwidth() * figure.dpi
    for text in figure.texts:
        assert text.get_window_extent().x1 <= width


def test_a_crank_that_goes_back_is_drawn_over_time(rigid):
    """Over its angle, one part of a line would lie on another."""
    poses = rigid.poses.copy()
    turn = np.sin(np.linspace(0, 20, len(rigid.time)))
    poses[:, 0, 2] = 8 * turn
    for draw in (coordinates, forces):
        figure = draw(replace(rigid, poses=poses))
        assert "time (s)" in words(figure).splitlines(), draw.__name__


def test_a_run_without_a_crank_is_drawn_over_seconds():
    """The cart is at its stop at 0 s, and runs for one second."""
    result = simulate(scene_of(parse_document(CART, "cart.yaml")), measure=False)
    x, label = along(result)
    assert label == "time (s)"
    np.testing.assert_array_equal(x, result.time)
    axes = coordinates(result).axes
    assert label in [panel.get_xlabel() for panel in axes]
    assert all(panel.get_xlim() == (0, 1) for panel in axes if panel.lines)


def test_pitch_circles_of_gears_touch_where_they_mesh():
    """Of teeth 20 and 30, their axes 0.1 m apart: circles of 40 and 60 mm, on the axes."""
    wheel = "{type: rigid, mass: 1, inertia: 1.0e-3, points: {o: [0, 0]}}"
    text = f"""title: gears
bodies: {{one: {wheel}, two: {wheel}}}
joints:
  a: {{type: revolute, points: [ground, one.o], at: [0, 0]}}
  b: {{type: revolute, points: [ground, two.o], at: [0.1, 0]}}
  mesh: {{type: gear, joints: [a, b], teeth: [20, 30]}}
run: {{duration: 0.1}}
accuracy: {{tolerance: 1.0e-6}}
"""
    mechanism = build_mechanism(scene_of(parse_document(text, "gears.yaml")))
    (gear,) = mechanism.gears
    assert [radius for _, radius in pitch_circles(gear)] == pytest.approx([0.04, 0.06])
    assert [anchor.part for anchor, _ in pitch_circles(gear)] == [0, 1]
