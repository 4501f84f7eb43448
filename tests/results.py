"""Results made by closed form, for tests of what is done with a Result: no engine needed."""

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
from matplotlib.text import Text
from small_scenes import PENDULUM, scene_from

from exudyn_flexlink.engines.touching import HERMITE, ExtremeSeeker
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import (
    EnergyMeter,
    approach,
    build_mechanism,
)
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import (
    Checks,
    ContactHistory,
    EnergyHistory,
    EngineSettings,
    Extremes,
    Integrator,
    Interval,
    Intervals,
    MeasuredError,
    Outcome,
    Result,
    SleeveHistory,
)
from exudyn_flexlink.storage import save, staged_folder

MODEL = Path(__file__).parents[1] / "models" / "no_clearance.yaml"
SPEED = 10.0  # rad/s, of the model's motor
LENGTH = 0.07  # m, of the link
CRANK = (0.02, 0.0)  # m, C
LEVER_FREQUENCY, LEVER_DAMPING, LEVER_PEAK = 2 * pi * 40, 0.1, 0.16
IMPULSE = 2e-4  # N s


def solved_to(tolerance: float | None) -> EngineSettings:
    """Settings of a run to a tolerance (m)."""
    return EngineSettings(Integrator("any", 9, tolerance=tolerance))


SLIDER = """title: a rigid block in a straight slot
curves:
  rail: {type: line, from: [-1, 0], to: [1, 0]}
bodies:
  block: {type: rigid, mass: 1, inertia: 1, points: {nose: [0.1, 0]}}
joints:
  rail: {type: slot, point: block.centre, curve: rail}
run: {duration: 1}
accuracy: {tolerance: 1.0e-5}
"""


BLOCK = SLIDER.replace("{duration: 1}", "{duration: 1, sample: 10 ms}")

GUIDE, LINK, REACH, PLAY = 0.09, 0.07, 0.04, 1e-3  # m: lengths, from guide's to link's start; +-
TILTING = f"""title: a rigid link that tilts in its guide
materials:
  steel: {{density: 7850, youngs_modulus: 200 GPa}}
bodies:
  guide: {{type: rod, length: {GUIDE}, material: steel, section: {{width: 20 mm, thickness: 9 mm}}}}
  link: {{type: rod, length: {LINK}, material: steel, section: {{width: 10 mm, thickness: 1 mm}}}}
joints:
  crank: {{type: revolute, points: [ground, guide.start], at: [0.02, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link, clearance: {PLAY},
           law: {{stiffness: 1.0e5, restitution: 0.5}}}}
drives:
  motor: {{type: speed, joint: crank, value: {SPEED} rad/s}}
run: {{turns: 4, of: crank}}
accuracy: {{tolerance: 4.0e-5}}
"""


def put(result, folder):
    """Write a result to its place, as the program does."""
    with staged_folder(Path(folder)) as staged:
        save(result, staged)


def guide_distance(scene, theta):
    """Distance CP (N,) on the scene's track, of the guide at the angles theta from 0 on.

    Seen from C, P goes round one way; Newton's method finds it on the guide's line, near where a
    table of its directions has it.
    """
    curve = build_mechanism(scene).slots[0].curve
    table = curve.period * np.linspace(0, max(theta) / (2 * pi) + 1, 500)
    away = (curve.point(table) - CRANK) @ [1, 1j]
    u = np.interp(theta, np.unwrap(np.angle(away)), table)
    back = np.exp(-1j * theta)
    for _ in range(5):
        away, way = ((x @ [1, 1j]) * back for x in (curve.point(u) - CRANK, curve.derivative(u)))
        u = u - away.imag / way.imag
    return away.real


def exact_s(scene, times):
    """Where S of `rigid_link` is (K, 2), m, at instants (s): C + (r + l) e(theta)."""
    theta = SPEED * times
    reach = guide_distance(scene, theta) + LENGTH
    return CRANK + reach[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=1)


def rigid_link(turns=4.0, samples=1601, scene=None):
    """The paper's mechanism with a straight link: S = C + (r(theta) + l) e(theta).

    The lever's motion is made up: a damped swing begins at theta = pi of every odd lap, with two
    contacts 2 ms and 1 ms long, 1 ms apart.
    """
    scene = scene or load_scene(MODEL, [f"run.turns={turns}"])
    time = np.linspace(0, turns * 2 * pi / SPEED, samples)
    theta = SPEED * time
    reach = guide_distance(scene, theta)
    mechanism = build_mechanism(scene)
    q = np.zeros((samples, len(mechanism.parts), 3))
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    for part in mechanism.bodies["guide"] + mechanism.bodies["link"]:
        q[:, part, 2] = theta
    q[:, 0, :2] = CRANK
    rods = mechanism.bodies["link"]
    for i, part in enumerate(rods):
        q[:, part, :2] = CRANK + (reach + i * LENGTH / len(rods))[:, None] * along
    begins = [t for t in (np.arange(0, turns, 2) + 0.5) * 2 * pi / SPEED if t < time[-1] - 0.01]
    lever = mechanism.bodies["lever"][0]
    q[:, lever, :2] = (-0.138, 0.0)
    q[:, lever, 2] = sum(_swing(time - begin) for begin in begins)
    return result_of(scene, time, q, _touches(begins))


def _swing(since):
    t = np.maximum(since, 0.0)
    decay = np.exp(-LEVER_DAMPING * LEVER_FREQUENCY * t)
    return -LEVER_PEAK * decay * np.sin(LEVER_FREQUENCY * t)


def _touches(begins):
    common = {"impulse": IMPULSE, "energy_lost": 1e-5, "peak_force": 0.4}
    return [
        touch
        for t in begins
        for touch in (
            Interval(t, t + 2e-3, 0.028, 0.028, 0.9, **common),
            Interval(t + 3e-3, t + 4e-3, 0.029, 0.03, 0.1, **common, slides_off=True),
        )
    ]


def result_of(scene, time, q, touches=()):
    """Fill a Result around a motion (N, parts, 3); forces are made up.

    In a sleeve with clearance they follow from how deep the link is in the walls.
    """
    mechanism = build_mechanism(scene)
    v = np.gradient(q, time, axis=0)
    contacts = {c.name: _contact(c, q, v, time, list(touches)) for c in mechanism.contacts}
    meter = EnergyMeter(mechanism)
    kinetic, stored = meter.kinetic(q, v), meter.potential(q)
    noise = 1e-9 * np.sin(50 * time)
    supplied = kinetic + stored - kinetic[0] - stored[0] + noise
    zeros = np.zeros_like(time)
    energy = EnergyHistory(kinetic, stored, zeros, supplied)
    residual, largest = float(np.max(np.abs(energy.residual))), float(np.max(kinetic))
    return Result(
        scene=scene,
        engine="exudyn",
        settings=EngineSettings(Integrator("any", 9, step=1e-4)),
        versions={"exudyn": "1.13.6", "numpy": np.__version__},
        timings={"prepare": 0.1, "solve": 1.5, "process": 0.2},
        part_names=tuple(part.name for part in mechanism.parts),
        time=time,
        poses=q,
        rates=v,
        drive_torques={name: 0.01 * np.sin(10 * time) for name in scene.drives},
        drive_forces={},
        joint_forces={pin.name: np.stack([time, -time], axis=-1) for pin in mechanism.pins},
        slot_forces={slot.name: np.stack([time, 0 * time], axis=-1) for slot in mechanism.slots},
        spring_forces={
            s.name: np.stack([0 * time, time], axis=-1) for s in mechanism.linear_springs
        },
        contacts=contacts,
        bearings={},
        sleeves={c.name: _sleeve(c, q, v, time) for c in mechanism.channels},
        energy=energy,
        extremes=_extremes(scene, time, (q, v), contacts),
        laps=(),
        checks=Checks(residual, largest, 1e-12, 100, 250, 1e-5, 1e-4, float("inf"), 1e-5),
        warnings=("made up",),
        outcome=Outcome(True, float(time[-1])),
        error=MeasuredError(missing="made up"),  # nobody makes a second run of it
    )


def with_its_extremes(result):
    """The same run with the extremes of its samples, which a test has changed."""
    motion = result.poses, result.rates
    return replace(result, extremes=_extremes(result.scene, result.time, motion, result.contacts))


def _extremes(scene, time, motion, contacts):
    """Those of the cubics between samples, as if each sample were a step."""
    mechanism = build_mechanism(scene)
    watched = Watched(scene, mechanism, motion[0][0])
    seeker = ExtremeSeeker(watched, mechanism.contacts, HERMITE)
    steps = tuple(np.stack([x[:-1], x[1:]], axis=1) for x in motion)
    pressed = np.zeros((len(time) - 1, len(mechanism.contacts)), dtype=bool)
    seeker.take(time[:-1], np.diff(time), steps, pressed, np.zeros(pressed.shape))
    found = seeker.extremes()
    for name, contact in contacts.items():
        inside = contact.force > 0
        found[f"{name}.force_N"] = Extremes(time[inside], contact.force[inside])
    return found


def _contact(contact, q, v, time, touches):
    near = approach(contact, q, v, 0.0)
    force = np.zeros_like(time)
    for touch in touches:
        force[(time >= touch.begin) & (time <= touch.end)] = touch.peak_force
    return ContactHistory(near.gap, near.place, force, Intervals.of(touches))


def _sleeve(channel, q, v, time):
    """Elastic walls: F = k d while the point is behind the face and beside none of its ends."""
    deep, rates, faces = [], [], channel.contacts
    for face in faces:
        near = approach(face, q, v, 0.0)
        beside = (near.place < 0) | (near.place > face.length)
        deep.append(np.where(beside, -np.abs(near.gap), -near.gap))
        rates.append(near.gap_rate)
    force = channel.law.stiffness * np.maximum(np.array(deep).T, 0.0)
    touches = Intervals.of(
        _touch(time, deep[k], rates[k], force[:, k], stretch, k)
        for k in range(len(faces))
        for stretch in _stretches(deep[k] > 0)
    )
    return SleeveHistory(
        tuple(face.name for face in faces),
        channel.sides,
        force,
        touches,
        float(max(np.max(deep), 0.0)),
    )


def _stretches(inside):
    """First and last sample of every stretch that is inside."""
    change = np.diff(inside.astype(int), prepend=0, append=0)
    return list(zip(np.flatnonzero(change > 0), np.flatnonzero(change < 0) - 1, strict=True))


def _touch(time, deep, rate, force, stretch, pair):  # noqa: PLR0917
    """One touch from its samples; energy lost: 0.1 m/s of its impulse."""

    begin, end = stretch

    def crossing(outer, inner):
        if not 0 <= outer < len(time):
            return float(time[inner])
        share = deep[inner] / (deep[inner] - deep[outer])
        return float(time[inner] + share * (time[outer] - time[inner]))

    steps, during = np.diff(time[begin : end + 1]), force[begin : end + 1]
    impulse = float(np.sum(steps * (during[1:] + during[:-1]) / 2))
    times = crossing(begin - 1, begin), crossing(end + 1, end)
    return Interval(
        *times,
        approach_speed=float(-rate[begin]),
        impulse=impulse,
        energy_lost=0.1 * impulse,
        peak_force=float(during.max()),
        penetration=float(deep[begin : end + 1].max()),
        pair=pair,
    )


def tilting_link(samples=4001):
    """A link that touches nothing in lap 1, one point in lap 2, two in laps 3 and 4.

    With s the sine of the angle turned in the lap, the link tilts by atan(0.06 s) about its start
    in lap 2: at the guide's end it is 3 mm s off the axis. In lap 3 all of it is 1.2 mm s off the
    axis, along the wall. In lap 4 its start is 1.2 mm s off and it tilts by -atan(0.06 s), so that
    at the guide's end it is -1.8 mm s off.
    """
    scene = scene_from(TILTING)
    time = np.linspace(0, 8 * pi / SPEED, samples)
    theta = SPEED * time
    lap = np.minimum(np.floor(theta / (2 * pi) + 1e-9) + 1, 4)
    off, slope = off_axis(lap, np.sin(theta))
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    q = np.zeros((samples, 2, 3))
    q[:, :, :2] = CRANK
    q[:, 1, :2] += REACH * along + off[:, None] * across
    q[:, 0, 2] = theta
    q[:, 1, 2] = theta + np.arctan(slope)
    return result_of(scene, time, q)


def off_axis(lap, s):
    """How far the start of the tilting link is off the guide's axis (m), and its slope there."""
    off = np.select([lap >= 3], [1.2e-3 * s], 0.0)
    return off, np.select([lap == 2, lap == 4], [0.06 * s, -0.06 * s], 0.0)


def block(motion, rate, samples=101, end=1.0, engine="exudyn"):
    """A block that moves along x: exact positions and rates at even samples."""
    time = np.linspace(0, end, samples)
    q = np.zeros((samples, 1, 3))
    q[:, 0, 0] = motion(time)
    made = result_of(scene_from(BLOCK), time, q)
    v = np.zeros_like(q)
    v[:, 0, 0] = rate(time)
    return replace(made, rates=v, engine=engine)


def pendulum(samples=101):
    time = np.linspace(0, 1, samples)
    q = np.zeros((samples, 1, 3))
    q[:, 0, 0] = 0.1
    q[:, 0, 2] = -pi / 2 + 0.5 * np.cos(5 * time)
    return result_of(scene_from(PENDULUM), time, q)


def slider(samples=51):
    time = np.linspace(0, 1, samples)
    q = np.zeros((samples, 1, 3))
    q[:, 0, 0] = 0.5 * np.sin(time)
    return result_of(scene_from(SLIDER), time, q)


def stopped(result):
    outcome = Outcome(False, 0.5, "no convergence at the smallest step", "allow a smaller step")
    return replace(result, outcome=outcome)


def touched(result, *touches, name="strike"):
    """The same run with other contacts of one name."""
    own = replace(result.contacts[name], touches=Intervals.of(touches))
    return replace(result, contacts={**result.contacts, name: own})


def retitled(result, title):
    return replace(result, scene=result.scene.changed(title=title))


def first_samples(result, count):
    """What is kept of a run that stops after `count` samples."""

    def cut(mapping):
        return {name: values[:count] for name, values in mapping.items()}

    energy, sleeves = result.energy, result.sleeves
    return replace(
        stopped(result),
        time=result.time[:count],
        poses=result.poses[:count],
        rates=result.rates[:count],
        drive_torques=cut(result.drive_torques),
        drive_forces=cut(result.drive_forces),
        joint_forces=cut(result.joint_forces),
        slot_forces=cut(result.slot_forces),
        contacts={
            name: ContactHistory(
                *(series[:count] for series in (c.gap, c.place, c.force)), Intervals.of()
            )
            for name, c in result.contacts.items()
        },
        sleeves={name: _begun(s, result.time[count - 1], count) for name, s in sleeves.items()},
        energy=EnergyHistory(
            energy.kinetic[:count],
            energy.stored[:count],
            energy.dissipated[:count],
            energy.supplied[:count],
        ),
        extremes={
            name: own.between(-np.inf, result.time[count - 1])
            for name, own in result.extremes.items()
        },
        laps=(),
    )


def _begun(sleeve, end, count):
    """What a run that stops at `end` (s) knows of a sleeve: its touches begun before."""
    touches = sleeve.touches.where(sleeve.touches.begin < end)
    lasts = np.where(touches.end > end, np.inf, touches.end)
    return replace(sleeve, force=sleeve.force[:count], touches=replace(touches, end=lasts))


def texts(figure):
    """Return all texts of a figure that say something."""
    return [text for text in figure.findobj(Text) if text.get_text()]


def words(figure):
    """Return what a figure says."""
    return "\n".join(text.get_text() for text in texts(figure))
