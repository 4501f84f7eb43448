"""Every model of the project loads, and the schema that editors use is that of the program."""

import json
from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.mechanism import equilibrium
from exudyn_flexlink.observables import State, contact_states, crank_angle, path
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.shipped import model_names, models_folder
from exudyn_flexlink.source import load_document

FOLDER = Path(__file__).parents[1] / "models"
FILES = [FOLDER / f"{name}.yaml" for name in model_names()]
SCHEMA = FOLDER / "flexlink.schema.json"


def test_the_schema_file_is_current():
    assert json.loads(SCHEMA.read_text(encoding="utf-8")) == json_schema(), (
        "run: exudyn-flexlink schema --out models/flexlink.schema.json"
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_moves_and_check_describes_it(path, capsys, monkeypatch):
    """Its first line names the schema that editors use; it says where its numbers come from.

    Three searches for other ways to close do what 24 do here: most of the time would be theirs.
    """
    monkeypatch.setattr(equilibrium, "STARTS", 3)
    scene = load_scene(path)
    assert scene.source
    assembly = assemble_scene(scene)
    # Planets share their load; nothing else holds twice.
    assert set(assembly.surplus) <= {gear.name for gear in assembly.mechanism.gears}
    assert main(["check", str(path)]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith(f"{path}: no mistakes\n\n{scene.title}\n")
    assert "Degrees of freedom: " in shown.out
    rows = [line for line in shown.out.splitlines() if line.startswith(" ")]
    assert max(map(len, rows)) <= 80
    assert shown.err == ""
    first = path.read_text(encoding="utf-8").splitlines()[0]
    relative = first.removeprefix("# yaml-language-server: $schema=")
    assert (path.parent / relative).resolve() == SCHEMA.resolve()


def scene(name):
    return load_scene(FOLDER / f"{name}.yaml")


def test_the_points_of_the_spline_track_are_those_of_its_formula():
    rows = (FOLDER / "track_points.csv").read_text(encoding="utf-8").splitlines()
    numbers = [line for line in rows if not line.startswith("#")][1:]
    points = np.array([[float(cell) for cell in line.split(",")] for line in numbers])
    angle = np.radians(15 * np.arange(24))
    radius = 0.04 - 0.02 * np.tanh(2 * np.cos(angle)) / np.tanh(2)
    expected = np.array([0.02, 0]) + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    assert np.abs(points - expected).max() <= 0.51e-7


def test_the_guide_always_covers_the_point_on_the_spline_track():
    curve = assemble_scene(scene("spline_track")).mechanism.slots[0].curve
    away = curve.point(np.linspace(curve.start, curve.end, 1000)) - np.array([0.02, 0])
    distance = np.hypot(*away.T)
    assert distance.min() > 0.012
    assert distance.max() < 0.075
    # One distance for every crank angle: the track goes round C without turning back.
    turned = np.diff(np.unwrap(np.arctan2(away[:, 1], away[:, 0])))
    assert turned.min() > 0
    assert turned.sum() == pytest.approx(2 * np.pi)


def test_models_mark_what_the_paper_leaves_open():
    for name in ("no_clearance", "smooth", "rigid", "clearance", "clearance_friction", "supported"):
        assert load_document(FOLDER / f"{name}.yaml").text.count("assumed") >= 4


# --- textbook -------------------------------------------------------------------------------------

TEXTBOOK = models_folder() / "textbook"


def run(name, *settings):
    result = simulate(load_scene(TEXTBOOK / f"{name}.yaml", settings))
    assert result.outcome.completed
    assert result.warnings == ()
    return result


def angle(result, part):
    return result.poses[:, result.part_names.index(part), 2]


def test_a_scotch_yoke_moves_as_the_cosine_of_its_crank():
    result = run("scotch_yoke")
    far = path(result, "stem.far").position
    expected = 0.4 + 0.1 * np.cos(crank_angle(result))
    np.testing.assert_allclose(far[:, 0], expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(far[:, 1], 0.0, rtol=0, atol=1e-12)


def test_a_geneva_wheel_indexes_in_every_turn_and_is_locked_meanwhile():
    """tan(wheel) = sin(driver) / (sqrt(2) - cos(driver)) from -45 to 45 degrees; else it dwells.

    Off by the play of 0.2 mm alone: of the pin in its slot, at its distance from the axle; of the
    disc in its hollow, at the arm of the corner or the horn that touches about the hub.
    """
    result = run("geneva_wheel", "drives.motor.value=30 rad/s")
    driver, wheel = angle(result, "driver"), angle(result, "wheel")
    turns = np.round(driver / (2 * np.pi))
    from_hub = driver - 2 * np.pi * turns  # the pin's direction; 0 is to the wheel
    inside = np.clip(from_hub, -np.pi / 4, np.pi / 4)
    ideal = -np.arctan2(np.sin(inside), np.sqrt(2) - np.cos(inside)) - np.pi / 2 * turns
    away = 0.1 * np.hypot(np.sin(inside), np.sqrt(2) - np.cos(inside))  # of the pin, m
    horn = np.radians(40)  # seen from the hub, while the wheel is locked
    corner = np.abs(from_hub) - np.pi / 4  # direction of the corner that locks
    arm = 0.1 * np.sqrt(2) * np.sin(np.clip(corner, 0, horn))
    given_way = max(history.touches.penetration.max(initial=0.0)
                    for history in result.contacts.values())  # fmt: skip
    assert given_way < 0.5e-3
    room = 0.2e-3 + given_way + 1e-6  # and the tolerance
    with np.errstate(divide="ignore"):  # no arm: the corner is between both centres
        play = np.arcsin(np.minimum(room / np.where(corner < 0, away, arm), 1))
    assert np.all(np.abs(wheel - ideal) <= play)
    assert np.ptp(turns) == 4
    locked = {name[:2] for name, touches in result.intervals.items() if "horn" in name and touches}
    assert locked == {"ab", "bc", "cd", "da"}


def test_the_pen_of_a_peaucellier_linkage_draws_a_straight_line():
    """At (long^2 - short^2) / (2 crank) from the pole; its height is that of an inversion."""
    result = run("peaucellier")
    pen, turned = path(result, "far_1.corner").position, angle(result, "crank")
    near = 0.12 * (1 + np.exp(1j * turned))  # the crank's pin, on a circle through the pole
    inverted = (0.3**2 - 0.1**2) / near.conj()
    np.testing.assert_allclose(pen @ [1, 1j], inverted, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pen[:, 0], 1 / 3, rtol=0, atol=1e-12)
    assert np.ptp(pen[:, 1]) > 0.2  # m


def test_a_toggle_press_presses_by_what_its_straight_knee_reaches():
    """Lowest at 0.4 m - 2 * 0.2 m: half a millimetre into a work of 2e7 N/m, whatever drives it."""
    result = run("toggle_press")
    (pressed,) = result.intervals["press"]
    assert pressed.penetration == pytest.approx(0.5e-3, abs=1e-8)
    assert pressed.peak_force == pytest.approx(10e3, rel=1e-4)
    assert np.abs(result.drive_torques["motor"]).max() < 20


def test_a_flexible_coupler_bends_as_a_beam_under_its_own_inertia():
    """5/768 (q1 + q2) L^4 / EI in the middle, for a load that grows evenly from q1 to q2.

    Slow enough to be in balance; eight rods bend like a beam up to 1/n^2.
    """
    result = run("slider_crank_flexible", "drives.motor.value=10 rad/s")
    late = result.time > 0.2  # after the ramp
    big, small = (path(result, name) for name in ("coupler.start", "slider.pin"))
    chord = small.position - big.position
    length = np.linalg.norm(chord, axis=1)
    assert length.max() <= 0.3 + 1e-9  # rods can't stretch
    along = chord / length[:, None]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    # Half a rod, seven rods, half a rod: the middle is the centre of the fifth part.
    half = 0.5 * 0.3 / 8
    turned = angle(result, "coupler 5")
    start = result.poses[:, result.part_names.index("coupler 5"), :2]
    middle = start + half * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    bent = np.einsum("ij,ij->i", middle - big.position, normal)
    pulls = sum(np.gradient(end.velocity, result.time, axis=0) for end in (big, small))
    load = -7850 * 40e-6 * np.einsum("ij,ij->i", pulls, normal)
    beam = 5 / 768 * load * 0.3**4 / (200e9 * 0.02 * 0.002**3 / 12)
    assert np.abs(bent[late]).max() == pytest.approx(np.abs(beam[late]).max(), rel=1 / 8**2)
    assert np.abs(bent - beam)[late].max() < 0.05 * np.abs(beam[late]).max()


def test_a_slider_with_clearance_stays_between_its_walls():
    result = run("slider_with_clearance")
    deepest = result.sleeves["way"].deepest
    assert deepest < 0.05e-3
    for end in ("slider.start", "slider.end"):
        side = path(result, end).position[:, 1]
        assert np.abs(side).max() <= 0.5e-3 + deepest + 1e-12
    shares = contact_states(result, "way").fractions()
    assert min(shares[s] for s in (State.FREE, State.ONE_POINT, State.SAME_SIDE)) > 0
    # Where it is, its coupler says: the crank's pin and the slider's are 120 mm apart.
    place, turned = path(result, "slider.start").position, crank_angle(result)
    pin = 0.05 * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    np.testing.assert_allclose(np.linalg.norm(place - pin, axis=1), 0.12, rtol=0, atol=1e-9)
