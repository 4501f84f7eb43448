"""Flexible bodies as beams: which can be, their numbers, and their items of Exudyn.

The link of an ideal sleeve is clamped where it starts: that point lies on the guide's axis and the
centre line leaves along it. Its start may run in a slot, its ends may strike. Everything else that
a scene can ask of a flexible body is refused by name.

The items are nodes with a slope, and cubic elements between them. Exudyn has geometrically exact
elements as well (``ObjectBeamGeometricallyExact2D``). They are linear between their nodes, so that
errors fall with the square of their number, those of the cubic ones with the fourth power. On a
cantilever of the paper's link, its end pushed by 4.7 mm in 10 ms and left to ring for 40 ms, four
cubic elements were off by 3.4e-6 m at 43 us per step, sixteen exact ones by 3.7e-5 m at 77 us.
Nor can they do without reference coordinates, which the native slot constraints must not have.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.redundant.beam_shape import CubicBeam, Elastic
from exudyn_flexlink.mechanism import GROUND, Anchor, FaceContact, Mechanism, Placed, State, beam_of
from exudyn_flexlink.scene import FlexibleBody, Scene, SleeveJoint

Refusal = tuple[tuple[str, ...], str]
"""Where in the scene something is that a beam can't be, and why."""

ELEMENTS = 2  # where the scene does not say
# Strain at three points of Lobatto, curvature at two of Gauss: see `beam_shape`.
REDUCED_INTEGRATION = 2


@dataclass(frozen=True)
class BeamLink:
    """A flexible body as a beam, in place of the parts `rods`, of the lengths (m) given.

    The rods remain what a Result shows: chords between points of the beam. `guide` is the part on
    whose axis the beam starts.
    """

    body: str
    rods: tuple[int, ...]
    lengths: tuple[float, ...]
    guide: int
    shape: CubicBeam

    @property
    def start(self) -> Anchor:
        """Where the beam starts, as an anchor of its first rod."""
        return Anchor(self.rods[0], 0.0, 0.0)

    @property
    def end(self) -> Anchor:
        """Where the beam ends, as an anchor of its last rod."""
        return Anchor(self.rods[-1], self.lengths[-1], 0.0)


def beams_of(scene: Scene, mechanism: Mechanism) -> tuple[BeamLink, ...]:
    """Return beams for all flexible bodies of a scene.

    Raises:
        NotRepresentableError: a flexible body can't be a beam.

    """
    return tuple(
        _beam(scene, mechanism, name, body)
        for name, body in scene.bodies.items()
        if isinstance(body, FlexibleBody)
    )


def without_rods(mechanism: Mechanism, beams: tuple[BeamLink, ...]) -> Mechanism:
    """Return the mechanism whose beams' rods have no mass and no hinges: the beams have both."""
    inside = {part for beam in beams for part in beam.rods}
    parts = tuple(
        replace(part, mass=0.0, inertia=0.0) if i in inside else part
        for i, part in enumerate(mechanism.parts)
    )
    pins = tuple(pin for pin in mechanism.pins if not {pin.first.part, pin.second.part} <= inside)
    springs = tuple(
        spring for spring in mechanism.springs if not {spring.first, spring.second} <= inside
    )
    return replace(mechanism, parts=parts, pins=pins, springs=springs)


def straight(beam: BeamLink, state: State) -> tuple[FloatArray, FloatArray]:
    """Positions and slopes of the nodes at time 0, unbent, and their rates: (controls, 2) each."""
    at, moved = state.q[beam.rods[0]], state.v[beam.rods[0]]
    along = np.array([np.cos(at[2]), np.sin(at[2])])
    turned = moved[2] * np.array([-along[1], along[0]])
    places = np.linspace(0, beam.shape.length, beam.shape.elements + 1)[:, None]
    controls = np.zeros((2, beam.shape.count, 2))
    controls[0, ::2], controls[0, 1::2] = at[:2] + places * along, along
    controls[1, ::2], controls[1, 1::2] = moved[:2] + places * turned, turned
    return controls[0], controls[1]


def add_beam(mbs: Any, beam: BeamLink, state: State) -> tuple[list[int], list[int]]:
    """Add nodes and elements, unbent as at time 0; return their numbers."""
    shape, elastic = beam.shape, beam.shape.elastic
    states = (x.reshape(-1, 4).tolist() for x in straight(beam, state))
    nodes = [
        mbs.AddNode(
            items.NodePoint2DSlope1(
                referenceCoordinates=[0.0] * 4, initialCoordinates=at, initialVelocities=moved
            )
        )
        for at, moved in zip(*states, strict=True)
    ]
    elements = [
        mbs.AddObject(
            items.ObjectANCFCable2D(
                nodeNumbers=[first, second],
                length=shape.element,
                massPerLength=elastic.mass,
                axialStiffness=elastic.axial,
                bendingStiffness=elastic.bending,
                axialDamping=elastic.lag * elastic.axial,
                bendingDamping=elastic.lag * elastic.bending,
                useReducedOrderIntegration=REDUCED_INTEGRATION,
            )
        )
        for first, second in pairwise(nodes)
    ]
    return [int(node) for node in nodes], [int(element) for element in elements]


def _beam(scene: Scene, mechanism: Mechanism, name: str, body: FlexibleBody) -> BeamLink:
    rods = mechanism.bodies[name]
    ends = mechanism.points[f"{name}.start"], mechanism.points[f"{name}.end"]
    for path, why in (
        *_lacking_of_body(name, body),
        *_lacking_joints(scene, mechanism, name, rods),
        *_lacking_contacts(mechanism, rods, ends),
        *_lacking_points(mechanism, rods, ends),
    ):
        raise NotRepresentableError(path, why)
    slides = [slide for slide in mechanism.slides if slide.second.part == rods[0]]
    if len(slides) != 1:
        raise NotRepresentableError(
            ("bodies", name), "a beam is the link of one sleeve without clearance"
        )
    guide = slides[0].first.part
    if guide == GROUND or len(mechanism.bodies[mechanism.parts[guide].body]) > 1:
        raise NotRepresentableError(("joints", slides[0].name, "guide"), "must be rigid")
    beam = beam_of(scene, body)
    axial = scene.materials[body.material].youngs_modulus * body.section.area
    # A hinge with damping d takes d times the change of angle, which its cell of length l spreads:
    # the resistance of a beam to changing curvature is d l.
    lag = body.hinges.damping * (body.length / body.rods) / beam.bending_stiffness
    elastic = Elastic(beam.mass_per_length, axial, beam.bending_stiffness, lag)
    shape = CubicBeam(beam.length, scene.solver.elements or ELEMENTS, elastic)
    lengths = tuple(2 * mechanism.parts[rod].centre[0] for rod in rods)
    return BeamLink(name, rods, lengths, guide, shape)


def _lacking_of_body(name: str, body: FlexibleBody) -> Iterator[Refusal]:
    own, stiffness = ("bodies", name), body.hinges.stiffness
    if stiffness != "beam":
        why = f"'{stiffness}' is no beam's: with formulation beam it must be 'beam'"
        yield (*own, "hinges", "stiffness"), why
    if not body.slender:
        why = "the elements have no inertia of the section; with formulation beam it must be true"
        yield (*own, "slender"), why
    if body.stretch:
        yield (*own, "stretch"), "a beam stretches anyhow: leave it out"
    if body.rods < 2:
        yield (*own, "rods"), "a beam is shown by its chords: at least two"


def _lacking_joints(
    scene: Scene, mechanism: Mechanism, name: str, rods: tuple[int, ...]
) -> Iterator[Refusal]:
    for joint_name, joint in scene.joints.items():
        if isinstance(joint, SleeveJoint) and joint.link == name and joint.law is not None:
            key = "clearance" if joint.clearance > 0 else "supported"
            why = "a beam touches no walls: its sleeve must be ideal"
            yield ("joints", joint_name, key), why
    for held in (*mechanism.attachments, *mechanism.bearings):
        ends = {held.first.part, held.second.part} & set(rods)
        if ends and (len(ends) == 1 or held.name in scene.joints):
            yield ("joints", held.name), "a beam has a sleeve and slots, no other joints"
    for slot in mechanism.slots:
        if slot.anchor.part in rods and slot.anchor != Anchor(rods[0], 0.0, 0.0):
            why = f"of a beam only '{name}.start' runs in a slot"
            yield ("joints", slot.name, "point"), why


def _lacking_contacts(
    mechanism: Mechanism, rods: tuple[int, ...], ends: tuple[Anchor, Anchor]
) -> Iterator[Refusal]:
    for contact in mechanism.contacts:
        own = "contacts", contact.name
        point = contact.point if isinstance(contact, FaceContact) else None
        if point and point.part in rods and point not in ends:
            yield (*own, "point"), "a beam strikes with its ends alone"
        if set(contact.parts[1:] if point else contact.parts) & set(rods):
            yield (*own, "line") if point else own, "a beam strikes with its end; nothing meets it"


def _lacking_points(
    mechanism: Mechanism, rods: tuple[int, ...], ends: tuple[Anchor, Anchor]
) -> Iterator[Refusal]:
    """What takes hold of a beam elsewhere than at its ends, or needs axes of it."""

    def within(*anchors: Anchor) -> bool:
        return any(anchor.part in rods and anchor not in ends for anchor in anchors)

    for spring in mechanism.linear_springs:
        if within(spring.first, spring.second):
            yield ("springs", spring.name), "a beam is held by springs at its ends alone"
    for force in mechanism.forces:
        if within(force.point):
            yield ("drives", force.name, "point"), "a beam is pushed at its ends alone"
        if force.axes in rods:
            yield ("drives", force.name, "axes"), "a beam bends: it has no axes of its own"
    for name, size in mechanism.sizes:
        if within(*(sense.point for sense in size.senses if isinstance(sense, Placed))):
            why = "a drive feels where a beam's ends are, no other points of it"
            yield ("drives", name, "value"), why
