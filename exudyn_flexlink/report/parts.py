"""Reports on parts: effects, curves, frequencies, degrees of freedom, the state at time 0.

Further reports are on a mechanism at rest: its pose, the forces that hold it, small motions; and on
linear equations about a state.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import degrees, hypot, pi, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.chain import euler_bernoulli_cantilever
from exudyn_flexlink.curves import CornerArc, Curve, Spline, finer
from exudyn_flexlink.laws import LineContact, PowerPenalty, PressingLaw, RestitutionPenalty
from exudyn_flexlink.linear import LinearModel, Mode, motion_text
from exudyn_flexlink.loading import other_ways, rest_of_scene
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Assembly,
    LinearSpring,
    Mechanism,
    Rest,
    RotarySpring,
    beam_of,
    build_curves,
    chain_of,
    idle_at_start,
    inertia_with_welded,
    length_along,
    moved_by_forces,
    shared_forces,
    speed_along,
    welded_to,
    wound_at_start,
)
from exudyn_flexlink.mechanism.equilibrium import SAME_WAY
from exudyn_flexlink.report.text import (
    Table,
    in_blocks,
    left_out,
    lines_of,
    number,
    section,
    table,
)
from exudyn_flexlink.rounding import ROUNDING
from exudyn_flexlink.scene import (
    DampedLaw,
    Flank,
    FlexibleBody,
    ImpulseLaw,
    Law,
    RevoluteJoint,
    Scene,
    SleeveJoint,
    SlidePenalty,
    SlotJoint,
    StopLaw,
    TurnPenalty,
)
from exudyn_flexlink.source import MOST_LISTED, listed

DECIMALS = 9  # of degrees, metres and newtons: smaller values are rounding


def equilibrium_text(scene: Scene, rest: Rest) -> str:
    """Return the whole report of a mechanism at rest, as text."""
    places = [
        [
            name,
            f"{_balance_text(degrees(pose[2]))} deg",
            f"at ({_balance_text(pose[0])}, {_balance_text(pose[1])}) m",
        ]
        for name, pose in ((name, np.atleast_2d(poses)[0]) for name, poses in rest.poses.items())
    ]
    torques = {name: f"{torque:.5g} N m" for name, torque in rest.torques.items()}
    forces = [
        [
            name,
            f"({_balance_text(x)}, {_balance_text(y)}) N",
            f"{hypot(x, y):.5g} N",
            torques.get(name, ""),
        ]
        for name, (x, y) in ((name, force.tolist()) for name, force in rest.forces.items())
    ]
    slides = {motor.name for motor in rest.assembly.mechanism.speed_motors if motor.slide}
    meshing = {gear.name for gear in rest.assembly.mechanism.gears if gear.in_newtons}
    presses = [
        [name, f"{press:.5g} {scene.unit_of(name, 'N')}"] for name, press in rest.presses.items()
    ]
    blocks = [
        [f"At rest: {rest_text(rest)}"],
        section("Places", places),
        section("Forces in joints, on the body of the second point", forces),
        section("What drives hold", _held(rest.drives, slides)),
        section("What gears and belts hold", _held(rest.gears, meshing)),
        section("Contacts that press", presses),
        _small_motions(rest),
        section("To know", [["", note] for note in rest.notes]),
    ]
    return in_blocks(blocks)


def rest_text(rest: Rest) -> str:
    """Say whether a rest is stable, in a few words."""
    if not rest.stable:
        return f"unstable, small motions grow by exp({rest.growth:.4g} t/s)"
    free = int((rest.frequencies == 0).sum())
    if not len(rest.frequencies):
        return "nothing can move"
    if free == len(rest.frequencies):
        return "nothing resists a motion"
    return "stable" + (f", but nothing resists {free} of the motions" if free else "")


def _held(numbers: Mapping[str, float], forces: Collection[str]) -> list[list[str]]:
    """Return rows of the loads that hold the rest: `forces` are in N, all others in N m."""
    return [[name, f"{x:.5g} {'N' if name in forces else 'N m'}"] for name, x in numbers.items()]


def _small_motions(rest: Rest) -> list[str]:
    """Return the frequencies of small motions; with a damper, also the damped ones."""
    exponents = rest.damped
    if not len(exponents):
        return section("Small motions about it, undamped", [["", _modes(rest)]])
    damped = [["", motion_text(exponent)] for exponent in exponents[:MOST_LISTED].tolist()]
    damped[0][0] = "damped"
    return section("Small motions about it", [["undamped", _modes(rest)], *damped])


def _modes(rest: Rest) -> str:
    return listed([f"{number(frequency)} Hz" for frequency in rest.frequencies.tolist()]) or "none"


def _balance_text(value: float) -> str:
    return f"{round(value, DECIMALS) + 0.0:.6g}"  # adding 0 avoids -0


MODES = 4


def linear_text(model: LinearModel) -> str:
    """Return the text of linear equations: modes, coordinates, contacts, errors."""
    about = "its rest" if model.time is None else f"t = {model.time:.6g} s"
    shown = list(enumerate(model.modes[:MOST_LISTED], start=1))
    modes = [[str(k), motion_text(mode.eigenvalue), _most_moved(mode)] for k, mode in shown]
    by_unit: dict[str, list[str]] = {}
    for name, unit in zip(model.coordinates, model.units, strict=True):
        by_unit.setdefault(unit, []).append(name)
    matrices = (
        ("stiffness", model.stiffness, model.stiffness_error),
        ("damping", model.damping, model.damping_error),
    )
    errors = [
        [name, f"{np.abs(error).max() / np.abs(matrix).max():.1g} of the largest"]
        for name, matrix, error in matrices
        if np.any(matrix)
    ]
    more = left_out(len(model.modes), len(modes))
    head = ["", "motion", "moves most"]
    blocks = [
        [f"Linear about {about}: '{model.scene.title}'"],
        lines_of(Table("Modes", modes, head, note=more)),
        section("Coordinates", [[unit, listed(names)] for unit, names in by_unit.items()]),
        section("Contacts that press", [["", name] for name in model.pressing]),
        section("Errors of differences", errors),
    ]
    return in_blocks(blocks)


def _most_moved(mode: Mode) -> str:
    """Name the point with the largest motion, and its motion."""
    if not mode.points:
        return ""
    name, moved = max(mode.points.items(), key=lambda point: float(np.linalg.norm(point[1])))
    return f"{name} ({abs(moved[0]):.3g}, {abs(moved[1]):.3g})"


def link_frequencies(scene: Scene, name: str, body: FlexibleBody) -> list[str]:
    """Return natural frequencies of a flexible body, clamped at its first rod, and of a beam."""
    chain = chain_of(scene, body)
    count = min(MODES, len(chain.hinges))
    if count == 0:
        return [f"Natural frequencies of {name}: none, one rod has no hinges"]
    rods = chain.cantilever_frequencies(count) / (2 * pi)
    beam = euler_bernoulli_cantilever(beam_of(scene, body), count) / (2 * pi)
    rows = [["mode", "rods", "beam", "deviation"]]
    for i in range(count):
        deviation = f"{100 * (rods[i] / beam[i] - 1):+.2f} %"
        rows.append([str(i + 1), f"{rods[i]:.2f} Hz", f"{beam[i]:.2f} Hz", deviation])
    return [
        f"Natural frequencies of {name}, first rod clamped, against an Euler-Bernoulli beam",
        *table(rows),
        *_rule(name, body),
    ]


def _rule(name: str, body: FlexibleBody) -> list[str]:
    rule = body.hinges.stiffness
    if rule == "paper":
        return [
            f"  hinge stiffness by the rule 'paper': E I / length of {name}",
            "  The link gets softer with every rod; 'beam' tends to the Euler-Bernoulli beam",
        ]
    if rule == "beam":
        better = [] if body.layout == "half_ends" else ["  'layout: half_ends' comes closer"]
        return ["  hinge stiffness by the rule 'beam': E I / length of a rod", *better]
    return [f"  hinge stiffness given as a number, {number(float(rule))} N m/rad"]


def sprung_frequencies(scene: Scene, mechanism: Mechanism) -> list[str]:
    """Return the undamped frequencies of bodies that only one joint with a spring holds.

    A body includes all that is welded to it. The joint holds it on the ground.
    """
    rows = []
    for joint, springs in _springs_of_joints(scene, mechanism).items():
        stiffness = sum(spring.stiffness for spring in springs)
        held = _held_by(joint, mechanism)
        if held is None or stiffness <= 0 or any(spring.law for spring in springs):
            continue
        turns = isinstance(springs[0], RotarySpring)
        parts, welds = mechanism.parts, mechanism.welds
        welded = sorted(welded_to(held.part, welds))
        mass = sum(parts[part].mass for part in welded)
        inertia = inertia_with_welded(held, parts, welds) if turns else mass
        frequency = sqrt(stiffness / inertia) / (2 * pi)
        ratio = sum(spring.damping for spring in springs) / (2 * sqrt(stiffness * inertia))
        way = f"{'about' if turns else 'along'} {joint}"
        texts = [f"{frequency:.2f} Hz", f"damping ratio {number(ratio)}"]
        rows.append([listed([parts[part].body for part in welded]), way, *texts])
    return section("Natural frequencies of sprung bodies, by themselves", rows)


def _springs_of_joints(
    scene: Scene, mechanism: Mechanism
) -> dict[str, list[RotarySpring | LinearSpring]]:
    """Return the scene's springs at a revolute joint or along a prismatic one, by joint."""
    springs_by: dict[str, list[RotarySpring | LinearSpring]] = {}
    for spring in mechanism.all_springs:
        spec = scene.springs.get(spring.name)  # hinges of flexible bodies have springs, too
        if spec is not None and spec.joint is not None:
            springs_by.setdefault(spec.joint, []).append(spring)
    return springs_by


def _held_by(joint: str, mechanism: Mechanism) -> Anchor | None:
    """Return the point at which this joint alone holds a part on the ground, or None."""
    ends = [anchor for name, anchor in _anchors(mechanism) if name == joint]
    held = [anchor for anchor in ends if anchor.part != GROUND]
    if len(ends) != 2 or len(held) != 1:
        return None
    welded, inner = welded_to(held[0].part, mechanism.welds), {w.name for w in mechanism.welds}
    joints = {name for name, other in _anchors(mechanism) if other.part in welded} - inner
    return held[0] if joints == {joint} and GROUND not in welded else None


def _anchors(mechanism: Mechanism) -> list[tuple[str, Anchor]]:
    """Return both anchors of every joint, with its name; of a slot, the anchor on the part."""
    joints = (*mechanism.hinges, *mechanism.welds, *mechanism.slides)
    return [
        *((joint.name, anchor) for joint in joints for anchor in (joint.first, joint.second)),
        *((slot.name, slot.anchor) for slot in mechanism.slots),
        *((groove.name, groove.slot.anchor) for groove in mechanism.grooves),
    ]


def curve_lines(scene: Scene) -> list[str]:
    """Return the section of curves: length, extent, ends, smallest radius; for splines, chords."""
    rows = []
    for name, curve in build_curves(scene.curves)[0].items():
        spec = scene.curves[name]
        carried = f" on {spec.on}" if spec.on else ""
        ends = "closed" if curve.closed else "open"
        rows.append([name, f"{spec.type}{carried}, {ends}", f"{number(curve.length())} m long"])
        points, bend = _looked_at(curve)
        points[np.abs(points) < ROUNDING * curve.size] = 0.0
        low, high = points.min(axis=0), points.max(axis=0)
        x, y = (f"{number(a)} to {number(b)} m" for a, b in zip(low, high, strict=True))
        rows.append(["", "extent", f"x {x}, y {y}"])
        if bend > 0:
            rows.append(["", "smallest radius", f"{number(1 / bend)} m"])
        corners = [piece for piece in curve.pieces if isinstance(piece, CornerArc)]
        if corners:
            radii = {number(corner.radius): None for corner in corners}
            rows.append(["", f"{len(corners)} corners", f"radius {listed([*radii])} m"])
        if isinstance(curve, Spline):
            chords = np.linalg.norm(np.diff(curve.point(curve.cubics()[0]), axis=0), axis=1)
            between = f"{number(chords.min())} to {number(chords.max())} m apart"
            rows.append(["", f"{len(curve.points)} points", between])
    return section("Curves", rows)


def _looked_at(curve: Curve) -> tuple[FloatArray, float]:
    """Return closely spaced points (n, 2) m of a curve, and the largest curvature there, 1/m."""
    points, bends = [], [0.0]
    for piece in curve.pieces:
        u = finer(piece.grid())
        points.append(piece.point(u))
        bends.append(float(np.abs(piece.curvature(u)).max()))
    return np.concatenate(points), max(bends)


def effects_table(scene: Scene, mechanism: Mechanism) -> Table:
    """Return a row for each effect: whether it is simulated, and which parts of the scene cause it.

    Losses in impacts have their own row, apart from viscous damping of hinges and springs.
    """
    flexible = [n for n, b in scene.bodies.items() if isinstance(b, FlexibleBody) and b.rods > 1]
    laws = scene.laws
    # Joints that can have clearance.
    kinds = (SleeveJoint, RevoluteJoint, SlotJoint)
    walled = {n: j for n, j in scene.joints.items() if isinstance(j, kinds)}
    loose = dict.fromkeys(s.joint for s in scene.stops.values() if isinstance(s, Flank))
    stopped = [n for n, stop in scene.stops.items() if not isinstance(stop, Flank)]
    sleeves = {n: j for n, j in walled.items() if isinstance(j, SleeveJoint)}
    lossy = [n for n, law in laws.items() if law.restitution is not None and law.restitution < 1]
    rough = [n for n, law in laws.items() if getattr(law, "friction", 0.0) > 0]
    rough += [friction.name for friction in mechanism.frictions]
    # All hinges of a link count as one entry, with the name of the link.
    damped = [
        s.name.split(" hinge ")[0]
        for s in mechanism.all_springs
        if s.damping > 0 or (s.law is not None and not s.law.stores)
    ]
    damped += [n for n, stop in scene.stops.items() if getattr(stop.law, "damping", None)]
    damped += [n for n, rope in scene.ropes.items() if rope.damping]
    gravity = [f"({number(scene.gravity[0])}, {number(scene.gravity[1])}) m/s^2"]
    rows = [
        _effect("flexibility", flexible),
        _effect("clearance", [*(n for n, j in walled.items() if j.clearance > 0), *loose]),
        _effect("support in the guide", [n for n, j in sleeves.items() if j.supported]),
        _effect("impact", [*scene.contacts, *stopped]),
        _effect("friction", rough),
        _effect("damping", list(dict.fromkeys(damped))),
        _effect("restitution below 1", lossy),
        _effect("gravity", gravity if any(scene.gravity) else []),
    ]
    return Table("Effects", rows)


def law_cells(law: Law | StopLaw, force: PressingLaw) -> list[str]:
    """Return the name of a law, its restitution and its friction."""
    if isinstance(law, SlidePenalty | TurnPenalty):
        unit = ("N/m", "N s/m") if isinstance(law, SlidePenalty) else ("N m/rad", "N m s/rad")
        damped = f"c {number(law.damping or 0.0)} {unit[1]}"
        lossy = damped if law.restitution is None else f"restitution {number(law.restitution)}"
        return [f"k {number(law.stiffness)} {unit[0]}", lossy, ""]
    restitution = f"restitution {restitution_text(law)}"
    rub = getattr(law, "friction", 0.0)
    friction = f"friction {number(rub)}" if rub > 0 else ""
    if isinstance(law, ImpulseLaw):
        return ["rigid, by impulse", restitution, friction]
    name = getattr(law, "formula", None) or law.type
    if isinstance(force, LineContact):
        about = f"{name}, no force beyond {number(force.deepest)} m"
    elif isinstance(force, PowerPenalty):
        about = f"{name}, K {number(force.stiffness)} N/m^{number(force.exponent)}"
    else:
        about = f"k {number(force.stiffness)} N/m" if isinstance(force, RestitutionPenalty) else ""
    return [about, restitution, friction]


def restitution_text(law: Law | ImpulseLaw) -> str:
    """Return the restitution of a law, and its real restitution if that differs."""
    asked = number(law.restitution)
    given = asked if not isinstance(law, DampedLaw) else number(law.returned)
    return asked if given == asked else f"{asked} asked, gives {given}"


def restitution_table(scene: Scene) -> Table:
    """Return the real restitution of laws that only approximate the requested one."""
    rows = [
        [name, law.type, restitution_text(law)]
        for name, law in scene.laws.items()
        if isinstance(law, DampedLaw)
    ]
    return Table("Restitution of contact laws", rows)


def _effect(name: str, causes: Sequence[str]) -> list[str]:
    return [name, "simulated", ", ".join(causes)] if causes else [name, "not in this scene", ""]


def freedom_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return the degrees of freedom, what determines each, and redundant joints."""
    drives = [motor.name for motor in assembly.mechanism.speed_motors]
    left = assembly.degrees_of_freedom
    rows = []
    if drives:
        rows.append(["prescribed", f"{len(drives)}, by {listed(drives)}"])
    if left:
        rows.append(["left to forces", f"{left}: {_moved(scene, assembly)}"])
    if assembly.surplus:  # minimal coordinates omit these
        names = listed(list(assembly.surplus))
        about = f"{names}: other joints hold the same already, in every position"
        rows.append(["held twice", about])
        shared = shared_forces(assembly)
        geared = [gear.name for gear in assembly.mechanism.gears if gear.name in shared]
        if geared:
            about = f"{listed(geared)}: how they share it is not known; the least forces are given"
            rows.append(["load shared", about])
    count = left + len(drives)
    fixed = "" if count else ", nothing can move"
    return [f"Degrees of freedom: {count}{fixed}", *table(rows)]


def _moved(scene: Scene, assembly: Assembly) -> str:
    """Return which parts forces move, and which they bend."""
    moved = moved_by_forces(assembly)
    bodies = scene.bodies.items()
    bent = [name for name, body in bodies if isinstance(body, FlexibleBody) and body.rods > 1]
    texts = [f"they move {listed(moved)}"] if moved else []
    texts += [f"they bend {listed(bent)}"] if bent else []
    return "; ".join(texts)


def start_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return angles of bodies and places along slides at time 0, with their speeds.

    A flexible body has the angle and speed of its first rod. The lines also list other ways to
    close the joints, and contacts that do not act at first.
    """
    state, bodies = assembly.state, assembly.mechanism.bodies.items()
    here = {body: float(state.q[parts[0], 2]) for body, parts in bodies}
    speeds = {body: float(state.v[parts[0], 2]) for body, parts in bodies}
    ways = [
        {b: a for b, a in way.items() if abs(_wrapped(a - here[b])) > SAME_WAY}
        for way in ([] if scene.initial.at_rest else other_ways(scene, assembly))
    ]
    others = [
        ["The joints close in other ways, too; 'initial: guesses' picks one:"],
        *(["", _angles(way, {})] for way in ways),
    ]
    idle = [["", note] for _, note in idle_at_start(assembly.mechanism, state.q, state.v)]
    idle += [["", note] for note in wound_at_start(assembly.mechanism, state.q)]
    if scene.initial.at_rest:
        rest = rest_of_scene(scene)
        idle += [["", f"at rest: {rest_text(rest)}"], *(["", note] for note in rest.notes)]
    slides = [["", _places(assembly)]] if assembly.mechanism.slides else []
    rows = [["", _angles(here, speeds)], *slides, *(others if ways else []), *idle]
    return section("Start", rows)


def _angles(angles: dict[str, float], speeds: Mapping[str, float]) -> str:
    texts = {body: f"{body} {_rounded(degrees(_wrapped(a)))} deg" for body, a in angles.items()}
    return listed([text + _moving(speeds.get(body, 0.0), "rad/s") for body, text in texts.items()])


def _places(assembly: Assembly) -> str:
    """Return the place of each sliding part along its line, as `initial: along` gives it."""
    slides, q, v = assembly.mechanism.slides, assembly.state.q, assembly.state.v
    texts = [f"along {s.name} {_rounded(float(length_along(s, q)))} m" for s in slides]
    speeds = [float(speed_along(s, q, v)) for s in slides]
    return listed([text + _moving(speed, "m/s") for text, speed in zip(texts, speeds, strict=True)])


def _moving(speed: float, unit: str) -> str:
    """Return the text of a speed after the place; empty without motion."""
    return f" at {_rounded(speed)} {unit}" if abs(speed) > SAME_WAY else ""


def _rounded(value: float) -> str:
    return number(round(value, DECIMALS) + 0.0)  # adding 0 avoids -0


def _wrapped(angle: float) -> float:
    """Return the angle between -pi and pi."""
    return float(np.angle(np.exp(1j * angle)))
