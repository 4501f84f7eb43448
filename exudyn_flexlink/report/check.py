"""The report of `check` on a model: parts, effects, frequencies, steps, formulation."""

from __future__ import annotations

from math import degrees, inf

from exudyn_flexlink import scene as specs
from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.integrate.problem import order_of, stages_for
from exudyn_flexlink.laws import Impulse, LineContact, PowerPenalty
from exudyn_flexlink.mechanism import (
    Assembly,
    Channel,
    Contact,
    Gear,
    LinearSpring,
    Mechanism,
    RotarySpring,
    SumStop,
    coarse_tolerance,
    contact_mass,
    end_of_run,
    formulation,
    half_period,
    resolutions,
    turn_goal,
)
from exudyn_flexlink.mechanism.prescribed import Formula
from exudyn_flexlink.observables import judged_points, name_of, watched_point
from exudyn_flexlink.report.parts import (
    curve_lines,
    effects_table,
    freedom_lines,
    law_cells,
    link_frequencies,
    sprung_frequencies,
    start_lines,
)
from exudyn_flexlink.report.text import in_blocks, lines_of, number, section
from exudyn_flexlink.scene import (
    BeltJoint,
    Drive,
    FlexibleBody,
    ForceDrive,
    GearJoint,
    Joint,
    PinFriction,
    PointsJoint,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SleeveJoint,
    SlotJoint,
    Spring,
    Stage,
    Table,
    TorsionalSpring,
    Value,
    meshes_of,
)

IDLE = "; its law is idle at clearance 0"
WIDEST = 40  # longest expression in the report, in letters


def check_text(scene: Scene, assembly: Assembly) -> str:
    """Return the report of a valid scene: parts, effects, frequencies and steps."""
    blocks = [
        [scene.title],
        _bodies(scene, assembly.mechanism),
        _joints(scene, assembly.mechanism),
        curve_lines(scene),
        _springs(scene, assembly.mechanism),
        _rests(scene, assembly.mechanism),
        section("Drives", [[n, d.type, *_drive(scene, d)] for n, d in scene.drives.items()]),
        _contacts(scene, assembly.mechanism),
        lines_of(effects_table(scene, assembly.mechanism)),
        freedom_lines(scene, assembly),
        start_lines(scene, assembly),
        *(
            link_frequencies(scene, name, body)
            for name, body in scene.bodies.items()
            if isinstance(body, FlexibleBody)
        ),
        sprung_frequencies(scene, assembly.mechanism),
        _run(scene, assembly),
    ]
    return in_blocks(blocks)


def run_duration(scene: Scene, assembly: Assembly) -> float | None:
    """Return the simulated time in s; None if the motion decides it (turns under a torque)."""
    if turn_goal(scene, assembly) is not None:
        return None
    return end_of_run(scene, assembly.mechanism)


def _bodies(scene: Scene, mechanism: Mechanism) -> list[str]:
    rows = []
    for name, body in scene.bodies.items():
        parts = [part for part in mechanism.parts if part.body == name]
        count = f"{len(parts)} rigid part{'s' if len(parts) > 1 else ''}"
        mass = f"{sum(part.mass for part in parts):.5g} kg"
        length = getattr(body, "length", None)
        about = "" if length is None else f"{number(length)} m long"
        rows.append([name, body.type, count, mass, about])
    return section("Bodies", rows)


def _joints(scene: Scene, mechanism: Mechanism) -> list[str]:
    geared = {gear.name: _geared(scene, gear) for gear in mechanism.all_gears}
    rows = [
        [name, joint.type, geared.get(name) or _joined(joint)]
        for name, joint in scene.joints.items()
    ]
    joined = {body for joint in scene.joints.values() for body in joint.bodies}
    rows += [["", "none", f"{body} is free"] for body in scene.bodies if body not in joined]
    return section("Joints", rows)


def _geared(scene: Scene, gear: Gear) -> str:
    """Return what a gear couples, and its pitch circles as far as they are known."""
    spec = scene.joints[gear.name]
    assert isinstance(spec, GearJoint | BeltJoint)  # no other joint makes a gear
    arm, meshes = meshes_of(scene.joints, spec)
    bodies = [mesh.body for mesh in meshes]
    known = [f"{number(radius)} m" for radius in gear.radii if radius is not None]
    circles = (
        f", pitch radi{'i' if len(known) > 1 else 'us'} {' and '.join(known)}" if known else ""
    )
    inside = " inside" if isinstance(spec, GearJoint) and spec.internal else ""
    sides = [stop for stop in scene.stops.values() if stop.joint == gear.name]
    played = f", flanks at {' and '.join(stop.text(stop.at) for stop in sides)}" if sides else ""
    idle = IDLE if isinstance(spec, GearJoint) and spec.law and not sides else ""
    return f"{bodies[0]} and {bodies[1]}{inside}, on {arm}{circles}{played}{idle}"


def _joined(joint: Joint) -> str:
    if isinstance(joint, SlotJoint):
        play = f", clearance {number(joint.clearance)} m on each side" if joint.acting else ""
        pin = f", pin of radius {number(joint.radius)} m" if joint.acting and joint.radius else ""
        idle = IDLE if joint.law and not joint.acting else ""
        return f"{joint.point} on {joint.curve}{play}{pin}{idle}"
    if isinstance(joint, SleeveJoint):
        return f"{joint.link} in {joint.guide}, {_fit(joint)}"
    assert isinstance(joint, PointsJoint)  # gears have their own texts: see `_geared`
    along = ""
    if isinstance(joint, PrismaticJoint):
        x, y = joint.axis
        along = f" along ({number(x)}, {number(y)})"
    clearance = joint.clearance if isinstance(joint, RevoluteJoint) else 0.0
    play = f", clearance {number(clearance)} m" if clearance > 0 else ""
    idle = IDLE if isinstance(joint, RevoluteJoint) and joint.law and not joint.acting else ""
    about = f"{along}{play}{idle}{_freewheel_and_friction(joint)}"
    return f"{joint.points[0]} and {joint.points[1]}{_placed(joint.at)}{about}"


def _freewheel_and_friction(joint: Joint) -> str:
    """Return the direction in which a freewheel lets a joint turn, and the joint's dry friction."""
    friction = joint.friction if isinstance(joint, (RevoluteJoint, PrismaticJoint)) else None
    one_way = joint.freewheel if isinstance(joint, RevoluteJoint) else None
    free = f", freewheel {one_way}" if one_way else ""
    if friction is None or not friction.acts:
        return free
    constant, unit, place = getattr(friction, "force", 0.0), "N", ""
    if isinstance(friction, PinFriction):
        constant, unit = friction.torque, "N m"
        place = f" at radius {number(friction.radius or 0)} m"
    texts = [f"{number(constant)} {unit}"] if constant > 0 else []
    if friction.coefficient > 0:
        texts.append(f"coefficient {number(friction.coefficient)}{place}")
    return f"{free}, friction {' and '.join(texts)}"


def _fit(sleeve: SleeveJoint) -> str:
    if sleeve.supported:
        return "every rod inside held on its axis"
    if sleeve.clearance > 0:
        return f"clearance {number(sleeve.clearance)} m on each side"
    return f"on its axis, rod 1 aligned{IDLE if sleeve.law else ''}"


def _springs(scene: Scene, mechanism: Mechanism) -> list[str]:
    rows = [
        [spring.name, _where(scene.springs[spring.name]), *_spring_numbers(spring)]
        for spring in mechanism.all_springs
        if spring.name in scene.springs
    ]
    lengths = {rope.name: rope.free_length.at(0.0) for rope in mechanism.ropes}
    for name, rope in scene.ropes.items():
        side, begins = ("longer", "pulls") if rope.acts == "tension" else ("shorter", "pushes")
        length = (
            f"{number(lengths[name])} m, as assembled"
            if rope.length is None
            else _value(rope.length, "m")
        )
        what = f"{_where(rope)}, {begins} where {side} than {length}"
        if rope.preload:
            what += f", from {number(rope.preload)} N on"
        rows.append([name, what, *_spring_numbers(rope)])
    for name in scene.bodies:
        for kind, what in (("stretch", "rods stretch"), ("hinge", "hinges")):
            springs = [s for s in mechanism.all_springs if s.name.startswith(f"{name} {kind} ")]
            if springs:  # half rods at the ends may be stiffer
                inner = _spring_numbers(springs[len(springs) // 2])
                rows.append([f"{name}, {len(springs)} {what}", "each", *inner])
    return section("Springs", rows)


def _rests(scene: Scene, mechanism: Mechanism) -> list[str]:
    """Return the rows of springs of constant stiffness, with the place of zero force."""
    rows = []
    for spring in mechanism.all_springs:
        spec = scene.springs.get(spring.name)
        if spec is None or spring.law is not None or not spring.stiffness:
            continue
        if isinstance(spring, RotarySpring):
            rest, given = f"{number(degrees(spring.rest_angle or 0.0))} deg", "rest_angle"
        else:
            rest, given = f"{number(spring.length or 0.0)} m", "length"
        assembled = ", as assembled" if getattr(spec, given) is None else ""
        rows.append([spring.name, f"{rest}{assembled}"])
    return section("Springs rest at", rows)


def _where(spring: Spring) -> str:
    if isinstance(spring, TorsionalSpring):
        return f"at {spring.joint}"
    if isinstance(spring, specs.RopeSpring):
        places = (place if isinstance(place, str) else _place(place) for place in spring.over)
        return f"over {', '.join(places)}"
    if spring.points is None:
        return f"along {spring.joint}"
    return f"between {spring.points[0]} and {spring.points[1]}{_placed(spring.at)}"


def _placed(place: tuple[float, float] | None) -> str:
    return "" if place is None else f" at {_place(place)}"


def _place(place: tuple[float, float]) -> str:
    return f"({number(place[0])}, {number(place[1])}) m"


def _spring_numbers(
    spring: RotarySpring | LinearSpring | specs.LinearSpring | specs.RopeSpring,
) -> list[str]:
    force, change = ("N m", "rad") if isinstance(spring, RotarySpring) else ("N", "m")
    rest = "no spring"
    if isinstance(spring, specs.LinearSpring | specs.RopeSpring):
        rest = "a table"  # a one-sided spring without stiffness has a table
    elif spring.law is not None:
        law = spring.law.applied
        rest = str(law.expression) if isinstance(law, Formula) else "a table"
    return [
        f"k {number(spring.stiffness)} {force}/{change}" if spring.stiffness else rest,
        f"c {number(spring.damping)} {force} s/{change}" if spring.damping else "no damper",
    ]


def _drive(scene: Scene, drive: Drive) -> tuple[str, str]:
    """Return where a drive acts, and how."""
    if isinstance(drive, ForceDrive):
        axes = f" in the axes of {drive.axes}" if drive.axes in scene.bodies else ""
        x, y = (_value(value, "N") for value in drive.value)
        return f"at {drive.point}", f"x: {x}, y: {y}{axes}"
    turns = isinstance(scene.joints[drive.joint], RevoluteJoint)
    units = {"speed": ("m/s", "rad/s"), "motion": ("m", "rad"), "torque": ("", "N m")}
    unit = units[drive.type][turns]
    ramp = getattr(drive, "ramp", 0.0)
    within = f", reached within {number(ramp)} s" if ramp else ""
    return f"at {drive.joint}", f"{_value(drive.value, unit)}{within}"


def _value(value: Value, unit: str) -> str:
    if isinstance(value, Expression):
        text = str(value) if len(str(value)) <= WIDEST else str(value)[: WIDEST - 3] + "..."
        return f"{text} ({unit})"
    if isinstance(value, Table):
        return f"table of {len(value.points or ())} rows, {value.rule} ({unit})"
    return f"{number(value)} {unit}"


def _contacts(scene: Scene, mechanism: Mechanism) -> list[str]:
    forces = {contact.name: contact.law for contact in (*mechanism.touching, *mechanism.channels)}
    touching = {**scene.contacts, **scene.stops}
    rows = [
        [name, str(contact), *law_cells(contact.law, forces[name])]
        for name, contact in touching.items()
    ]
    for name, joint in scene.joints.items():
        if isinstance(joint, RevoluteJoint) and joint.acting is not None:
            journal, bearing = joint.points
            what = f"journal at {journal} in the bearing at {bearing}"
            rows.append([name, what, *law_cells(joint.acting, forces[name])])
    for groove in mechanism.grooves:
        slot = scene.joints[groove.name]
        assert isinstance(slot, SlotJoint)  # no other joint makes a groove
        assert slot.acting is not None
        what = f"pin at {slot.point} between the walls along {slot.curve}"
        rows.append([groove.name, what, *law_cells(slot.acting, groove.law)])
    for channel in mechanism.channels:
        sleeve = scene.joints[channel.name]
        assert isinstance(sleeve, SleeveJoint)  # no other joint makes a channel
        assert sleeve.acting is not None
        count = len(channel.contacts)
        if sleeve.supported:
            what = f"{sleeve.link} on the axis of {sleeve.guide}, held at up to {count} points"
        else:
            what = f"{sleeve.link} on the walls of {sleeve.guide}, {count} pairs can touch"
        rows.append([channel.name, what, *law_cells(sleeve.acting, channel.law)])
    return section("Contacts", rows)


def _run(scene: Scene, assembly: Assembly) -> list[str]:
    duration = run_duration(scene, assembly)
    mechanism, fixed_step = assembly.mechanism, scene.accuracy.step
    judges = judged_points(scene)
    judged = "it" if len(judges) == 1 else name_of(judges)
    watched = f"{watched_point(scene)} is shown; errors are judged by {judged}"
    rows = [["time", _time(scene, duration)], ["watched", watched]]
    rows += [[f"stage {k}", _stage(stage)] for k, stage in enumerate(scene.stages, 1)]
    named = [(contact.name, contact) for contact in (*mechanism.contacts, *mechanism.bearings)]
    named += [(groove.name, groove.contacts[0]) for groove in mechanism.grooves]
    rows += [[name, _contact_duration(assembly, contact)] for name, contact in named]
    rows += [[channel.name, _wall_duration(assembly, channel)] for channel in mechanism.channels]
    form = formulation(scene)
    if fixed_step is not None:
        count = "" if duration is None else f", about {duration / fixed_step:,.0f} steps"
        shorter = ", less where contacts, turns and pieces of curves ask for it"
        kept = shorter if form == "minimal" else count
        rows.append(["step", f"{number(fixed_step)} s, fixed{kept}"])
    else:
        tolerance = f"an error of {number(scene.accuracy.tolerance or 0.0)} m"
        rows.append(["step", f"chosen on the way by error control, for {tolerance}"])
    rows += [["", note] for note in coarse_tolerance(scene, assembly)]
    order = order_of(stages_for(mechanism.contacts_and_pairs, scene.accuracy.tolerance))
    rows.append(["formulation", _FORMULATIONS[form].format(order)])
    if form != "minimal" and (resolved := resolutions(scene, assembly)):
        longest = min(*(contact.step for contact in resolved), fixed_step or inf)
        fewest = min(contact.steps(fixed_step) for contact in resolved)
        about = f"{number(fewest)} steps per contact, or more"
        rows.append(["", f"at most {number(longest)} s in contact: {about}"])
    return section("Run", rows)


_FORMULATIONS = {
    "minimal": "minimal: as many coordinates as freedoms, steps of order {}",
    "redundant": "redundant: rigid bodies held by joints, steps of order 2",
    "beam": "beam: rigid bodies held by joints and the link as a beam, steps of order 2",
}


def _time(scene: Scene, duration: float | None) -> str:
    """Return the length of the run, and what may end it earlier."""
    until = scene.run.until
    return _at_most(scene, duration) + (f", or until {until} rises through 0" if until else "")


def _stage(stage: Stage) -> str:
    """Return when a stage begins, and what it changes."""
    added = [f"{key}.{name}" for key, parts in stage.add for name in parts]
    changes = [
        *(f"without {name}" for name in stage.remove),
        *(f"with {name}" for name in added),
        *(f"another {key}" for key in stage.set),
    ]
    return f"as {stage.until} rises through 0: {', '.join(changes) or 'as before'}"


def _at_most(scene: Scene, duration: float | None) -> str:
    turns = "" if scene.run.turns is None else f"{number(scene.run.turns)} turns of {scene.run.of}"
    if duration is None:
        limit = scene.run.at_most
        within = "" if limit is None else f", at most {number(limit)} s"
        return f"{turns}, which the motion decides{within}"
    seconds = f"{number(duration)} s"
    return f"{seconds} ({turns})" if turns else seconds


def _contact_duration(assembly: Assembly, contact: Contact) -> str:
    if isinstance(contact.law, Impulse):
        return "impacts take no time: a rigid contact, by impulse"
    state = assembly.state
    mass = contact_mass(assembly.mechanism, contact, state.q, state.places)
    half = f"{number(contact.law.half_period(mass))} s"
    if isinstance(contact.law, PowerPenalty):
        return f"a contact of {number(mass)} kg lasts about {half} at an approach of 1 m/s"
    if isinstance(contact.law, LineContact):
        return f"a contact of {number(mass)} kg lasts {half} or longer"
    unit = "kg m^2" if isinstance(contact, SumStop) and contact.turns else "kg"
    return f"a contact lasts about {half} or longer (pi sqrt(m/k), m {number(mass)} {unit})"


def _wall_duration(assembly: Assembly, channel: Channel) -> str:
    half = f"{number(half_period(assembly, channel))} s"
    if channel.clearance > 0:
        return f"a contact with a wall lasts about {half} or longer, on the lightest node"
    return f"the lightest node swings on its axis with half a period of {half}"
