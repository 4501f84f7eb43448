"""Clearance in the hand-written equations against laws of nature and against `mechanism.contacts`.

The series of an independent integration are met in test_clearance, gaps and their gradients in
test_lagrangian_equations; here are the reactions that follow from them, what is recorded, pieces of
the track, and guides that rest or turn freely.
"""

from functools import cache

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import anchor_position, approach, build_mechanism
from exudyn_flexlink.observables import common_times, path, separation

PIVOT = np.array([0.02, 0.0])
FRICTION = "joints.sleeve.law.friction=0.2"
SHORT = ("contacts={}", "bodies.link.rods=3", "joints.sleeve.clearance=2 mm")
REST = (*SHORT, "drives.motor.value=0")
KICKED = {
    "inside": (*REST, "initial.speeds={link: 40}"),
    "out of the mouth": (*REST, "initial={angles: {guide: 150 deg}, speeds: {link: -60}}"),
}
SAMPLE = 2e-6  # s
TIGHT = "accuracy.tolerance=1e-9"
RING = ("curves.ring={type: circle, centre: [0.02, 0], radius: 0.03}", "joints.pin.curve=ring")


@cache
def run(*settings, model="clearance.yaml"):
    scene = load_scene(MODELS / model, [TIGHT, *settings])
    result = simulate(scene, "lagrangian")
    assert result.outcome.completed, result.outcome
    return result


def channel_of(result):
    return build_mechanism(result.scene).channels[0]


def on_guide(result):
    """Force (N, 2) and moment (N,) about the pivot that the link gives the guide, by `approach`."""
    force, moment = np.zeros((len(result.time), 2)), np.zeros(len(result.time))
    channel, history = channel_of(result), result.sleeves["sleeve"]
    for k, contact in enumerate(channel.contacts):
        at = approach(contact, result.poses, result.rates, 0.0)
        along = -contact.side * np.stack([-at.normal[:, 1], at.normal[:, 0]], axis=-1)
        press = history.force[:, k]
        push = press[:, None] * at.normal
        if channel.friction is not None:
            push += channel.friction.force(press, at.slip)[:, None] * along
        # The force acts on the contact's point, and back on its face: one of the two is the guide.
        push = push if contact.point.part == channel.guide.part else -push
        x, y = (anchor_position(contact.point, result.poses) - PIVOT).T
        force += push
        moment += x * push[:, 1] - y * push[:, 0]
    return force, moment


def largest(values):
    return np.abs(values).max()


# --- what is recorded -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "met"), [("inside", {"node"}), ("out of the mouth", {"node", "rod"})]
)
def test_what_is_told_of_touches_in_a_guide_at_rest(case, met):
    """Sampled finely: of its forces, by quadrature over the samples, and gaps by `approach`."""
    settings = *KICKED[case], FRICTION, f"run={{duration: 15 ms, sample: {SAMPLE}}}"
    result = run(*settings)
    lasts_as_long_as_its_force(result, met)
    sums_up_its_samples(result)
    bears_what_the_link_gives_it(result)


def lasts_as_long_as_its_force(result, met):
    history = result.sleeves["sleeve"]
    touches = history.touches
    names = {history.pairs[k].split()[1] for k in touches.pair}
    assert names == met
    assert len(touches.begin) > 3
    assert np.all(np.diff(touches.begin) >= 0)
    inside = np.zeros(history.force.shape, dtype=bool)
    for k, begin, end in zip(touches.pair, touches.begin, touches.end, strict=True):
        inside[:, k] |= (result.time > begin) & (result.time < end)
    # What still presses as the run ends, presses in its last sample.
    assert np.array_equal(inside[:-1], history.force[:-1] > 0)


def sums_up_its_samples(result):
    history, channel = result.sleeves["sleeve"], channel_of(result)
    touches, contacts = history.touches, channel.contacts
    for i, k in enumerate(touches.pair.tolist()):
        begin, end = touches.begin[i], touches.end[i]
        during = (result.time >= begin) & (result.time <= end)
        press, time = history.force[during, k], result.time[during]
        at = approach(contacts[k], result.poses[during], result.rates[during], 0.0)
        power = press * at.gap_rate + channel.friction.force(press, at.slip) * at.slip
        # A touch may begin and end by a jump, within a sample.
        impulse, jump = np.trapezoid(press, time), SAMPLE * press.max()
        assert touches.impulse[i] == pytest.approx(impulse, rel=1e-4, abs=jump)
        lost, jump = -np.trapezoid(power, time), SAMPLE * np.abs(power).max()
        if np.isinf(end):  # what its spring stores is not lost
            lost -= float(channel.law.stored_energy(-at.gap[-1]))
        assert touches.energy_lost[i] == pytest.approx(lost, rel=1e-4, abs=jump)
        assert touches.peak_force[i] == pytest.approx(press.max(), rel=1e-3)
        assert touches.approach_speed[i] == pytest.approx(-at.gap_rate[0], rel=1e-2)
        assert touches.penetration[i] == pytest.approx(-at.gap.min(), rel=1e-3)
        assert touches.place[i] == pytest.approx(at.place[0], abs=1e-3 * channel.length)


def bears_what_the_link_gives_it(result):
    """Pivot and motor hold the guide against all walls and corners, friction included."""
    force, moment = on_guide(result)
    assert largest(force) > 5
    assert largest(result.joint_forces["crank"] + force) < 1e-10 * largest(force)
    assert largest(result.drive_torques["motor"] + moment) < 1e-10 * largest(moment)


@pytest.mark.parametrize("case", KICKED)
def test_the_touches_lose_what_the_whole_run_loses(case):
    """Without dampers nothing else takes energy."""
    undamped = ("bodies.link.hinges.damping=0", "springs={}", FRICTION)
    result = run(*KICKED[case], *undamped, "run={duration: 8 ms}")
    touches, energy = result.sleeves["sleeve"].touches, result.energy
    assert touches.energy_lost.sum() == pytest.approx(energy.dissipated[-1], rel=1e-7)
    assert energy.dissipated[-1] > 1e-5


@pytest.mark.parametrize("case", KICKED)
def test_an_explicit_method_finds_the_same_touches(case):
    """SciPy's DOP853, which shares equations and events, but no integrator."""
    local = ("solver.integrator=dop853", "accuracy.tolerance=1e-6")
    short = (*KICKED[case], FRICTION, "run={duration: 6 ms}")
    one, other = run(*short), run(*short, *local)
    assert one.settings.integrator.method == "Radau IIA"
    assert other.settings.integrator.method == "DOP853"
    ours, judged = (result.sleeves["sleeve"].touches for result in (one, other))
    assert ours.pair.tolist() == judged.pair.tolist()
    assert len(ours.pair) > 2
    assert ours.begin == pytest.approx(judged.begin, abs=1e-8)
    assert ours.end == pytest.approx(judged.end, abs=1e-7)
    assert ours.impulse == pytest.approx(judged.impulse, rel=1e-4, abs=1e-10)
    assert ours.energy_lost == pytest.approx(judged.energy_lost, rel=1e-4, abs=1e-12)
    assert ours.peak_force == pytest.approx(judged.peak_force, rel=1e-2)


@pytest.mark.parametrize("case", KICKED)
def test_a_rattling_link_keeps_its_tolerance(case):
    short = (*KICKED[case], FRICTION, "run={duration: 6 ms, sample: 0.1 ms}")
    exact = run(*short, "accuracy.tolerance=1e-11")
    for tolerance in (1e-4, 1e-6, 1e-8):
        found = run(*short, f"accuracy.tolerance={tolerance}")
        times = common_times(exact, found)
        assert separation(exact, found, times, ["link.start", "link.end"]).max() < tolerance


def test_the_track_gives_the_link_no_force_along_it():
    """Momentum of the link alone gives the slot's force; it comes out normal to the ellipse."""
    result = run(*SHORT, FRICTION, "run={duration: 0.15}")
    x, y = path(result, "link.start").position.T
    tangent = np.stack([-y / 0.03**2, x / 0.04**2], axis=-1)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    force = result.slot_forces["pin"]
    assert len(result.sleeves["sleeve"].touches.begin) > 3
    assert largest(np.sum(force * tangent, axis=1)) < 1e-12 * largest(force)


def test_a_free_guide_and_its_link_keep_their_angular_momentum():
    """On a circle about the pivot the track gives no moment; what one gains the other loses."""
    free = ("drives={}", "initial.speeds={guide: 10, link: 40}")
    result = run(*SHORT, FRICTION, *RING, *free, "run={duration: 40 ms}")
    total = np.zeros(len(result.time))
    for i, part in enumerate(build_mechanism(result.scene).parts):
        if part.body == "lever":
            continue
        (x, y, angle), (vx, vy, turning) = result.poses[:, i].T, result.rates[:, i].T
        rx = np.cos(angle) * part.centre[0] - np.sin(angle) * part.centre[1]
        ry = np.sin(angle) * part.centre[0] + np.cos(angle) * part.centre[1]
        dx, dy = x + rx - PIVOT[0], y + ry - PIVOT[1]
        ux, uy = vx - turning * ry, vy + turning * rx
        total += part.mass * (dx * uy - dy * ux) + part.inertia * turning
    guide = result.rates[:, result.part_names.index("guide"), 2]
    assert np.ptp(guide) > 0.1  # rad/s
    assert len(result.sleeves["sleeve"].touches.begin) > 5
    assert total == pytest.approx(total[0], rel=1e-9)


def test_a_motor_torque_turns_the_free_guide():
    torque = "drives.motor={type: torque, joint: crank, value: 0.004}"
    result = run(*SHORT, torque, "run={duration: 0.1}")
    guide = result.poses[:, result.part_names.index("guide"), 2]
    assert guide[-1] > 0.03
    assert result.energy.supplied[-1] == pytest.approx(0.004 * (guide[-1] - guide[0]), rel=1e-8)
    assert result.checks.energy_residual < 1e-9 * result.checks.largest_kinetic_energy


# --- the track --------------------------------------------------------------------------------


def test_a_crank_that_runs_backwards_is_the_mirror_image():
    """From the ellipse of the egg to its circle, over the end of the piece and over its start.

    There |dgamma/du| drops from 40 mm to 30 mm, and P keeps its velocity.
    """
    ends = []
    for way in (1, -1):
        start = f"initial.angles.guide={80 * way} deg"
        turn = (f"drives.motor.value={10 * way}", "run={duration: 0.08, sample: 0.2 ms}")
        result = run(*SHORT, "joints.pin.curve=egg", start, *turn)
        seen = path(result, "link.start")
        assert seen.position[-1, 0] < -1e-3
        over = int(np.argmax(seen.position[:, 0] < 0))
        before, after = seen.velocity[over - 1 : over + 1]
        assert np.linalg.norm(after - before) < 0.02 * np.linalg.norm(before)
        assert result.checks.energy_residual < 1e-10 * result.checks.largest_kinetic_energy
        assert result.checks.constraint_error < 1e-15
        assert len(result.sleeves["sleeve"].touches.begin) > 0
        at = np.searchsorted(result.time, np.arange(0, 0.08, 1e-3) - 1e-9)
        ends.append(path(result, "link.end").position[at])
    assert ends[0] == pytest.approx(ends[1] * [1, -1], abs=1e-9)


def test_p_swings_about_the_seam_of_the_laps():
    """The link of a guide at rest, both ways over the seam: mirrored kicks mirror the motion."""
    ends = []
    for way in (1, -1):
        kick = f"initial.speeds={{link: {8 * way}}}"
        result = run(*REST, kick, "run={duration: 0.05, sample: 1 ms}")
        y = path(result, "link.start").position[:, 1]
        assert y.min() < -5e-4 < 5e-4 < y.max()
        assert result.checks.constraint_error < 1e-15
        assert result.checks.energy_residual < 1e-9 * result.checks.largest_kinetic_energy
        at = np.searchsorted(result.time, np.arange(0, 0.05, 1e-3) - 1e-9)
        ends.append(path(result, "link.end").position[at])
    assert ends[0] == pytest.approx(ends[1] * [1, -1], abs=1e-9)


# --- rods held on the axis --------------------------------------------------------------------


def test_supported_rods_stay_near_the_axis_and_have_no_touches():
    # Stiff axis, few steps: the energy that the last assertion asks for takes this tolerance.
    held = ("bodies.link.rods=3", "contacts={}", FRICTION, "accuracy.tolerance=1e-10")
    result = run(*held, "run={duration: 0.1}", model="supported.yaml")
    history = result.sleeves["sleeve"]
    assert len(history.touches.begin) == 0
    assert largest(history.force) > 0
    deepest = max(
        float(
            -approach(contact, result.poses, result.rates, 0.0).gap[history.force[:, k] > 0].min()
        )
        for k, contact in enumerate(channel_of(result).contacts)
        if (history.force[:, k] > 0).any()
    )
    assert deepest <= history.deepest * (1 + 1e-6)
    assert result.checks.largest_penetration == history.deepest
    assert result.checks.energy_residual < 1e-9 * result.checks.largest_kinetic_energy


def test_largest_forces_of_touches_do_not_depend_on_the_steps():
    """A force falls at once where the gap turns, between two stages of a step over half a touch."""
    settings = (*SHORT, "run={duration: 0.15, sample: 1 ms}")
    coarse, fine = (
        run(*settings, f"accuracy.tolerance={tolerance}").sleeves["sleeve"].touches
        for tolerance in (1e-6, 1e-9)
    )
    assert coarse.pair.tolist() == fine.pair.tolist()
    assert len(fine.pair) > 5
    assert coarse.peak_force == pytest.approx(fine.peak_force, rel=3e-3)
