"""Flexible bodies as beams: which can be, their numbers, and their items of Exudyn.

The link of an ideal sleeve is clamped where it starts: that point lies on the guide's axis and the
centre line leaves along it. Its start may run in a slot, its ends may strike. Everything else that
a scene can ask of a flexible body is refused by name.

The items are nodes with a slope, and cubic elements between them. Exudyn has geometrically exact
elements as well (``ObjectBeamGeometricallyExact2D``). They are
linear between their nodes, so that errors fall with the square of their number, those of the cubic
ones with the fourth power. Measured on a cantilever of the paper's link, its end pushed by 4.7 mm
in 10 ms and left to ring for 40 ms, in m and us per step:

========  =============  ====================
elements  cubic          geometrically exact
========  =============  ====================
1         4.8e-4   19    1.5e-3   14
2         4.8e-5   27    1.8e-3   19
4         3.4e-6   43    6.3e-4   27
8         2.2e-7   75    1.7e-4   44
16        1.7e-8   142   3.7e-5   77
========  =============  ====================

Nor can they do without reference coordinates, which the native slot constraints must not have.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.redundant.beam_shape import CubicBeam, Elastic
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    FaceContact,
    Mechanism,
    Placed,
    State,
    beam_of,
)
from exudyn_flexlink.scene import FlexibleBody, Scene, SleeveJoint

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
    _refuse_body(name, body)
    rods = mechanism.bodies[name]
    _refuse_joints(scene, mechanism, name, rods)
    ends = mechanism.points[f"{name}.start"], mechanism.points[f"{name}.end"]
    _refuse_points(mechanism, rods, ends)
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


def _refuse_body(name: str, body: FlexibleBody) -> None:
    stiffness = body.hinges.stiffness
    message = f"'{stiffness}' is no beam's: with formulation beam it must be 'beam'"
    inertia = "the elements have no inertia of the section; with formulation beam it must be true"
    for refused, key, why in (
        (stiffness != "beam", ("hinges", "stiffness"), message),
        (not body.slender, ("slender",), inertia),
        (body.stretch, ("stretch",), "a beam stretches anyhow: leave it out"),
        (body.rods < 2, ("rods",), "a beam is shown by its chords: at least two"),
    ):
        if refused:
            raise NotRepresentableError(("bodies", name, *key), why)


def _refuse_joints(scene: Scene, mechanism: Mechanism, name: str, rods: tuple[int, ...]) -> None:
    for joint_name, joint in scene.joints.items():
        if isinstance(joint, SleeveJoint) and joint.link == name and joint.law is not None:
            key = "clearance" if joint.clearance > 0 else "supported"
            raise NotRepresentableError(
                ("joints", joint_name, key), "a beam touches no walls: its sleeve must be ideal"
            )
    for held in (*mechanism.attachments, *mechanism.bearings):
        ends = {held.first.part, held.second.part} & set(rods)
        if ends and (len(ends) == 1 or held.name in scene.joints):
            raise NotRepresentableError(
                ("joints", held.name), "a beam has a sleeve and slots, no other joints"
            )
    for slot in mechanism.slots:
        if slot.anchor.part in rods and slot.anchor != Anchor(rods[0], 0.0, 0.0):
            raise NotRepresentableError(
                ("joints", slot.name, "point"), f"of a beam only '{name}.start' runs in a slot"
            )


def _refuse_points(
    mechanism: Mechanism, rods: tuple[int, ...], ends: tuple[Anchor, Anchor]
) -> None:
    """Refuse what takes hold of a beam elsewhere than at its ends, or needs axes of it."""
    strikers = [own for own in mechanism.contacts if isinstance(own, FaceContact)]
    held: list[tuple[tuple[str, ...], list[Anchor], str]] = [
        *(
            (("contacts", own.name, "point"), [own.point], "a beam strikes with its ends alone")
            for own in strikers
        ),
        *(
            (
                ("springs", own.name),
                [own.first, own.second],
                "a beam is held by springs at its ends alone",
            )
            for own in mechanism.linear_springs
        ),
        *(
            (("drives", own.name, "point"), [own.point], "a beam is pushed at its ends alone")
            for own in mechanism.forces
        ),
        *(
            (
                ("drives", name, "value"),
                [sense.point for sense in size.senses if isinstance(sense, Placed)],
                "a drive feels where a beam's ends are, no other points of it",
            )
            for name, size in mechanism.sizes
        ),
    ]
    for path, anchors, message in held:
        if any(anchor.part in rods and anchor not in ends for anchor in anchors):
            raise NotRepresentableError(path, message)
    for force in mechanism.forces:
        if force.axes in rods:
            raise NotRepresentableError(
                ("drives", force.name, "axes"), "a beam bends: it has no axes of its own"
            )
    for contact in mechanism.contacts:
        strikes = contact in strikers
        if set(contact.parts[1:] if strikes else contact.parts) & set(rods):
            key = ("line",) if strikes else ()
            raise NotRepresentableError(
                ("contacts", contact.name, *key), "a beam strikes with its end; nothing meets it"
            )
