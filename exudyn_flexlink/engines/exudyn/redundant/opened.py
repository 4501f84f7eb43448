"""A scene as an Exudyn system for users to work on; the program itself does not use it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Laps
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.redundant.contacts import Contacts
from exudyn_flexlink.engines.exudyn.redundant.run import built
from exudyn_flexlink.engines.exudyn.redundant.slots import SlotItems
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import Mechanism, end_of_run
from exudyn_flexlink.mechanism.joints import NO_ITEM
from exudyn_flexlink.mechanism.prescribed import Formula
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Mistake

Numbers = Mapping[str, tuple[int, ...]]


@dataclass(frozen=True, repr=False, eq=False)
class ExudynSystem:
    """A scene as Exudyn's items, assembled: `SC`, `mbs`, and item numbers by the scene's names.

    SI units; coordinates of a rigid body's node are x, y and angle, without reference values.
    `accelerations` (coordinates,) are those of the scene at time 0. Those computed by Exudyn lack
    terms of time alone; so set these, with ``computeInitialAccelerations = False``::

        mbs.systemData.SetODE2Coordinates_tt(system.accelerations, exu.ConfigurationType.Initial)

    `not_followed` lists what is missing when Exudyn solves alone: the program does it between
    steps. If you add items, call ``mbs.Assemble()`` again.
    """

    SC: Any
    mbs: Any
    title: str
    bodies: (
        Numbers  # objects: one for a rigid body; for a flexible body those of its rods or elements
    )
    nodes: Numbers
    joints: Numbers  # objects; a slot has one for each kind of piece, and one of them is active
    springs: Numbers  # objects; hinges are named as 'link hinge 1', here and in `joints`
    motors: Numbers  # objects of drives that prescribe a motion
    contacts: Numbers  # objects: of contacts, and of joints with play
    loads: Numbers  # loads of drives by torque or force
    points: Numbers  # markers of positions, by 'body.point'
    accelerations: FloatArray
    not_followed: tuple[str, ...]

    def __repr__(self) -> str:
        data = self.mbs.systemData
        lines = [
            f"<ExudynSystem of '{self.title}': {data.NumberOfNodes()} nodes, "
            f"{data.NumberOfObjects()} objects, {data.NumberOfMarkers()} markers, "
            f"{data.NumberOfLoads()} loads"
        ]
        kinds = [field.name for field in fields(self) if field.type == "Numbers"]
        named = {kind: getattr(self, kind) for kind in kinds}
        for kind, numbers in named.items():
            markers = {
                name: items for name, items in numbers.items() if " " not in name
            }  # no hinges
            parts = [f"{name} {', '.join(map(str, items))}" for name, items in markers.items()]
            lines += [f"  {kind:9} {'; '.join(parts)}"] if parts else []
        if self.not_followed:
            lines.append("  does not happen by itself when Exudyn solves alone:")
            lines += [f"    - {reason}" for reason in self.not_followed]
        return "\n".join(lines) + ">"


def opened(scene: Scene) -> ExudynSystem:
    """Build and assemble a scene, in redundant coordinates, or with beams if it asks for them.

    Raises:
        NotRepresentableError: Exudyn's own solver lacks an item of the scene, or a slot's curve has
            laps; the message names the line.
        SceneError: the scene can't be assembled.

    """
    assembly = assemble_scene(scene)
    try:
        for slot in assembly.mechanism.slots:
            if isinstance(slot.curve, Laps):
                message = "its curve has laps, which the program changes between steps"
                raise NotRepresentableError(("joints", slot.name, "curve"), message)
        system, slots, contacts = built(scene, assembly, [])
    except NotRepresentableError as error:
        raise NotRepresentableError(error.path, error.message + _where(scene, error)) from None
    # Exudyn calls functions of these objects: they must live as long as `mbs`, even if the user
    # keeps nothing else.
    system.mbs.variables[__name__] = system, slots, contacts
    points = _points(system)
    system.mbs.Assemble()
    mechanism = system.mechanism
    motors = zip(mechanism.speed_motors, system.motors, strict=True)
    return ExudynSystem(
        system.container,
        system.mbs,
        scene.title,
        bodies={name: _numbers(system.bodies, mechanism, name) for name in mechanism.bodies},
        nodes={name: _numbers(system.nodes, mechanism, name) for name in mechanism.bodies},
        joints=_joints(system, slots),
        springs={name: (number,) for name, number in system.springs.items()},
        motors={motor.name: (number,) for motor, number in motors},
        contacts=_contacts(contacts),
        loads={name: tuple(numbers) for name, numbers in system.loads.items()},
        points=points,
        accelerations=system.coordinates.start()[2],
        not_followed=tuple(_not_followed(scene, mechanism, slots, contacts)),
    )


def _where(scene: Scene, error: NotRepresentableError) -> str:
    place = scene.document.place_of(Mistake(error.path, ""))
    return f" ({scene.document.name}:{place.line}:{place.column})" if place else ""


def _points(system: System) -> dict[str, tuple[int, ...]]:
    """Add markers of all points, except those within beams."""
    ends = {end for beam in system.beams for end in (beam.start, beam.end)}
    return {
        name: (system.point_marker(anchor),)
        for name, anchor in system.mechanism.points.items()
        if anchor.part not in system.in_beams or anchor in ends
    }


def _numbers(items: Sequence[int], mechanism: Mechanism, body: str) -> tuple[int, ...]:
    """Numbers of a body's items; those within a beam are between its first and its last."""
    numbers = [int(items[part]) for part in mechanism.bodies[body]]
    return tuple(range(numbers[0], numbers[-1] + 1)) if NO_ITEM in numbers else tuple(numbers)


def _joints(system: System, slots: Sequence[SlotItems]) -> dict[str, tuple[int, ...]]:
    welds = {weld.name for weld in system.mechanism.welds}
    # A weld is two objects: its pin, and the next one, which holds the angle.
    markers = {n: (i, i + 1) if n in welds else (i,) for n, i in system.joints.items()}
    return markers | {slot.slot.name: tuple(dict.fromkeys(slot.item_of_piece)) for slot in slots}


def _contacts(contacts: Contacts) -> dict[str, tuple[int, ...]]:
    numbers: dict[str, tuple[int, ...]] = {}
    for contact in contacts.all:
        name = contact.channel.name if contact.channel else contact.contact.name
        numbers[name] = (*numbers.get(name, ()), *contact.items.numbers)
    return numbers


def _not_followed(
    scene: Scene, mechanism: Mechanism, slots: Sequence[SlotItems], contacts: Contacts
) -> list[str]:
    """What the program does between steps of the solver, but Exudyn alone does not."""
    reasons = [f"slot '{slot.slot.name}': {why}" for slot in slots for why in _of_slot(slot)]
    if pressing := ", ".join(_contacts(contacts)):
        reasons.append(
            f"contacts {pressing}: nothing presses, as their items are not active; no step is "
            "shortened for them, and where they press on a face does not move along it"
        )
    knots = mechanism.knots(end_of_run(scene, mechanism))
    if knots:
        shown = ", ".join([f"{knot:g}" for knot in knots[:6]] + ["..."] * (len(knots) > 6))
        reasons.append(
            f"drives jump or bend at {shown} s: no step "
            "ends there, and accelerations that the solver carries on are not renewed"
        )
    values = [(name, size.value) for name, size in mechanism.sizes]
    bent = [name for name, value in values if isinstance(value, Formula) and value.expression.kinks]
    reasons += [
        f"drive '{name}': no step ends where its formula bends with the state (max, min, abs)"
        for name in dict.fromkeys(bent)
    ]
    return reasons


def _of_slot(slot: SlotItems) -> list[str]:
    reasons = []
    if len(set(slot.item_of_piece)) > 1:
        reasons.append("the piece of its curve where it starts stays active beyond its ends")
    elif not slot.native:
        reasons.append("its place on the curve is always searched from where it starts")
    if not slot.curve.closed:
        reasons.append("nothing stops it at the ends of its curve")
    return reasons
