"""A mechanism as items of Exudyn: one for each thing the mechanism has, none for what it lacks.

Torques and forces of drives are loads; Exudyn calls Python for those that vary, in every iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import cos, nan, sin
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.engine import Engine, items
from exudyn_flexlink.engines.exudyn.redundant.beam import BeamLink, add_beam, without_rods
from exudyn_flexlink.engines.exudyn.redundant.coordinates import BeamCoordinates, Coordinates
from exudyn_flexlink.integrate.problem import Window
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Assembly,
    Gear,
    LinearSpring,
    Mechanism,
    Motor,
    Pin,
    PointForce,
    Ramp,
    RotarySpring,
    Size,
    Slide,
    TorqueMotor,
    Weld,
    constraints_at,
    force_at,
    motor_place,
    size_at,
)
from exudyn_flexlink.mechanism.joints import NO_ITEM


def add_loads(system: System) -> None:
    """Add all torques and forces."""
    for motor in system.mechanism.torque_motors:
        _add_torque(system, motor)
    for force in system.mechanism.forces:
        _add_force(system, force)


def loads_sense_state(system: System) -> bool:
    """Tell whether a load depends on the state, so that Newton's matrix needs its slopes."""
    turned = any(force.axes != GROUND for force in system.mechanism.forces)
    return turned or any(size.senses for _, size in system.mechanism.sizes)


def _constant(size: Size) -> float | None:
    """Return a number that stays; None if it varies."""
    ramp = size.value
    return ramp.value if isinstance(ramp, Ramp) and ramp.duration == 0 else None


def _add_torque(system: System, motor: TorqueMotor) -> None:
    constant = _constant(motor.size)
    for part, sign in ((motor.second, 1.0), (motor.first, -1.0)):
        if part == GROUND:
            continue

        def torque(time: float, q: FloatArray, v: FloatArray, sign: float = sign) -> float:
            return sign * size_at(motor.size, time, q, v)

        load = {"load": sign * constant} if constant is not None else {
            "loadUserFunction": _user_function(system, torque, nan)
        }  # fmt: skip
        marker = system.angle_marker(part)
        number = system.mbs.AddLoad(items.LoadCoordinate(markerNumber=marker, **load))
        system.loads.setdefault(motor.name, []).append(int(number))


def _add_force(system: System, force: PointForce) -> None:
    def push(time: float, q: FloatArray, v: FloatArray) -> list[float]:
        return [*force_at(force, np.array([time]), q[None], v[None])[0].tolist(), 0.0]

    x, y = (_constant(size) for size in force.sizes)
    load: dict[str, Any] = {"loadVectorUserFunction": _user_function(system, push, [nan] * 3)}
    if force.axes == GROUND and x is not None and y is not None:
        load = {"loadVector": [x, y, 0.0]}
    marker = system.point_marker(force.point)
    number = system.mbs.AddLoad(items.LoadForceVector(markerNumber=marker, **load))
    system.loads[force.name] = [int(number)]


def _user_function(system: System, load: Callable[..., Any], nothing: Any) -> Callable[..., Any]:
    """Function with which Exudyn asks for a load; `nothing` is returned where it has no value.

    `load` takes the time (s), and poses and rates (parts, 3).
    """

    def user_function(mbs: Any, time: float, _load: Any) -> Any:
        data = mbs.systemData
        q, v = data.GetODE2Coordinates().tolist(), data.GetODE2Coordinates_t().tolist()
        state = (np.reshape(x, (-1, 3)) for x in system.coordinates.plain(q, v))
        try:
            return load(system.window.inside(time), *state)
        except ArithmeticError as error:
            system.errors.append(error)
            return nothing

    return user_function


STRAIN_ROUNDING = 5e-15  # strain of an element as long as the mechanism is large


@dataclass
class System:
    """An Exudyn system and the numbers of its items; only `opened` hands them on, to users.

    Nodes have no reference values, so that coordinates are positions and angles themselves
    (quadratic constraints need that); `coordinates` reads them as parts. A beam's first rod has the
    node and the element at the beam's start, its last rod those at the beam's end.
    """

    coordinates: Coordinates
    beams: tuple[BeamLink, ...]
    container: Any = field(default_factory=Engine.SystemContainer)
    mbs: Any = None
    nodes: list[int] = field(default_factory=list)
    bodies: list[int] = field(default_factory=list)
    ground: int = 0
    ground_node: int = 0
    joints: dict[str, int] = field(default_factory=dict)  # pins, welds' points, and slides
    springs: dict[str, int] = field(default_factory=dict)
    motors: list[int] = field(default_factory=list)  # speed motors, in their order
    gears: list[int] = field(default_factory=list)  # in their order
    loads: dict[str, list[int]] = field(default_factory=dict)  # of torques and forces
    window: Window = field(default_factory=Window)  # limits the times at which drives are asked
    laws: dict[Any, Any] = field(default_factory=dict)  # symbolic functions, which must live on
    # Errors of drives without a value: Exudyn's solver must not see exceptions.
    errors: list[ArithmeticError] = field(default_factory=list)

    @property
    def assembly(self) -> Assembly:
        """What is simulated; rods of beams have neither mass nor hinges."""
        return self.coordinates.assembly

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the assembly."""
        return self.coordinates.mechanism

    @property
    def newton(self) -> tuple[float, float]:
        """Relative and absolute limit of the residual of Newton's method."""
        if not self.beams:
            return 1e-8, 1e-10
        # Beams are so stiff along their axis that the rounding of a coordinate makes a force; the
        # residual can't become smaller than that. A relative limit above 1e-9 would leave strains
        # that do not exist, since the first residual of a long step is large.
        size = float(abs(self.assembly.state.q[:, :2]).max())
        forces = [
            beam.shape.elastic.axial
            * STRAIN_ROUNDING
            * max(size, beam.shape.length)
            / beam.shape.element
            for beam in self.beams
        ]
        return 1e-9, max(1e-10, *forces)

    @property
    def in_beams(self) -> set[int]:
        """Parts that are rods of beams."""
        return {rod for beam in self.beams for rod in beam.rods}

    def multipliers(self, item: int) -> list[int]:
        """Indices of an item's Lagrange multipliers; after assembling."""
        return list(self.mbs.systemData.GetObjectLTGAE(item))

    def point_marker(self, anchor: Anchor) -> int:
        """Marker of an anchor's position."""
        body, place = self.place(anchor)
        marker = items.MarkerBodyPosition(bodyNumber=body, localPosition=place)
        return int(self.mbs.AddMarker(marker))

    def slide_markers(self, slide: Slide) -> list[int]:
        """Markers of a slide's two anchors, both with the x-axis along its line."""
        turns = slide.direction, slide.direction - slide.angle  # in the axes of either part
        anchors = slide.first, slide.second
        return [self._rigid_marker(*pair) for pair in zip(anchors, turns, strict=True)]

    def _rigid_marker(self, anchor: Anchor, turn: float) -> int:
        """Marker of an anchor's position and orientation, turned by an angle (rad) on its part."""
        c, s = cos(turn), sin(turn)
        for beam in self.beams:
            if anchor == beam.start:
                turned = [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
                node = items.MarkerNodeRigid(nodeNumber=self.nodes[anchor.part], localHT=turned)
                return int(self.mbs.AddMarker(node))
        body, (x, y, _) = self.place(anchor)
        turned = [[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]]
        return int(self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localHT=turned)))

    def angle_marker(self, part: int) -> int:
        """Marker of a part's angle."""
        if part == GROUND:
            marker = items.MarkerNodeCoordinate(nodeNumber=self.ground_node, coordinate=0)
        else:
            marker = items.MarkerNodeCoordinate(nodeNumber=self.nodes[part], coordinate=2)
        return int(self.mbs.AddMarker(marker))

    def place(self, anchor: Anchor) -> tuple[int, list[float]]:
        """Body of an anchor, and where it is in its axes."""
        if anchor.part == GROUND:
            return self.ground, [anchor.x, anchor.y, 0.0]
        for beam in self.beams:
            if anchor == beam.end:  # a body of a beam is one element of it
                return self.bodies[anchor.part], [beam.shape.element, 0.0, 0.0]
        return self.bodies[anchor.part], [anchor.x, anchor.y, 0.0]


def build_system(assembly: Assembly, beams: tuple[BeamLink, ...]) -> System:
    """Create bodies, pins, welds, slides, springs, motors, weight, gears; slots, contacts follow.

    Raises:
        NotRepresentableError: a flexible body that shall be a beam does not start straight, or a
            gear is not known to Exudyn's own solver.

    """
    assembly = replace(assembly, mechanism=without_rods(assembly.mechanism, beams))
    coordinates = BeamCoordinates(assembly, beams) if beams else Coordinates(assembly)
    system = System(coordinates, beams)
    system.mbs = system.container.AddSystem()
    system.ground = system.mbs.AddObject(items.ObjectGround())
    system.ground_node = system.mbs.AddNode(items.NodePointGround())
    mechanism = assembly.mechanism
    _add_parts(system)
    for pin in mechanism.pins:
        system.joints[pin.name] = _add_pin(system, pin)
    for weld in mechanism.welds:
        system.joints[weld.name] = _add_weld(system, weld)
    for slide in mechanism.slides:
        system.joints[slide.name] = _add_slide(system, slide)
    for spring in mechanism.springs:
        system.springs[spring.name] = _add_spring(system, spring)
    for linear in mechanism.linear_springs:
        system.springs[linear.name] = _add_linear_spring(system, linear)
    for motor in mechanism.speed_motors:
        system.motors.append(_add_speed_motor(system, motor))
    if any(mechanism.gravity):
        _add_weight(system)
    for gear in mechanism.gears:
        system.gears.append(_add_gear(system, gear))
    return system


def _add_parts(system: System) -> None:
    """Add nodes in the order of parts: that of `coordinates`."""
    state = system.assembly.state
    beams = {beam.rods[0]: beam for beam in system.beams}
    in_beams = system.in_beams
    for i, (part, q, v) in enumerate(zip(system.mechanism.parts, state.q, state.v, strict=True)):
        if i in beams:
            _add_beam(system, beams[i])
        if i in in_beams:
            continue
        node = system.mbs.AddNode(
            items.NodeRigidBody2D(initialCoordinates=q.tolist(), initialVelocities=v.tolist())
        )
        body = system.mbs.AddObject(
            items.ObjectRigidBody2D(
                mass=part.mass,
                inertia=part.inertia_about_origin,  # Exudyn wants it about the node, not the centre
                centerOfMass=list(part.centre),
                nodeNumber=node,
            )
        )
        system.nodes.append(node)
        system.bodies.append(body)


def _add_beam(system: System, beam: BeamLink) -> None:
    """Let the first rod stand for the beam's start and the last for its end."""
    nodes, elements = add_beam(system.mbs, beam, system.assembly.state)
    between = [NO_ITEM] * (len(beam.rods) - 2)
    system.nodes += [nodes[0], *between, nodes[-1]]
    system.bodies += [elements[0], *between, elements[-1]]
    for element in elements if any(system.mechanism.gravity) else ():
        marker = system.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=element))
        weight = [*system.mechanism.gravity, 0.0]
        system.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=weight))


def _add_pin(system: System, pin: Pin | Weld) -> int:
    markers = [system.point_marker(pin.first), system.point_marker(pin.second)]
    return int(system.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=markers)))


def _add_weld(system: System, weld: Weld) -> int:
    """Add a pin, which is returned, and what holds the angle."""
    pin = _add_pin(system, weld)
    markers = [system.angle_marker(weld.first.part), system.angle_marker(weld.second.part)]
    system.mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=markers, offset=weld.angle))
    return pin


def _add_slide(system: System, slide: Slide) -> int:
    return int(
        system.mbs.AddObject(
            items.ObjectJointPrismatic2D(
                markerNumbers=system.slide_markers(slide),
                axisMarker0=[1.0, 0.0, 0.0],
                normalMarker1=[0.0, 1.0, 0.0],
                constrainRotation=True,
            )
        )
    )


def _add_spring(system: System, spring: RotarySpring) -> int:
    # On angles directly: a TorsionalSpringDamper, which works on 3D markers, costs up to 1.6 times.
    markers = [system.angle_marker(spring.first), system.angle_marker(spring.second)]
    item = items.ObjectConnectorCoordinateSpringDamper(
        markerNumbers=markers,
        stiffness=spring.stiffness,
        damping=spring.damping,
        offset=spring.rest_angle or 0.0,
    )
    return int(system.mbs.AddObject(item))


def _add_linear_spring(system: System, spring: LinearSpring) -> int:
    k, c = spring.stiffness, spring.damping
    if spring.slide is not None:
        return _add_spring_along(system, spring, spring.slide)
    markers = [system.point_marker(spring.first), system.point_marker(spring.second)]
    if spring.length == 0:
        item = items.ObjectConnectorCartesianSpringDamper(
            markerNumbers=markers, stiffness=[k, k, 0.0], damping=[c, c, 0.0]
        )
    else:
        item = items.ObjectConnectorSpringDamper(
            markerNumbers=markers, stiffness=k, damping=c, referenceLength=spring.length
        )
    return int(system.mbs.AddObject(item))


def _add_spring_along(system: System, spring: LinearSpring, slide: Slide) -> int:
    """Let a spring act along the slide's line, which turns with the first part."""
    along = np.diag([1.0, 0, 0, 0, 0, 0])
    item = items.ObjectConnectorRigidBodySpringDamper(
        markerNumbers=system.slide_markers(slide),
        stiffness=spring.stiffness * along,
        damping=spring.damping * along,
        offset=[spring.length or 0.0, 0, 0, 0, 0, 0],
    )
    return int(system.mbs.AddObject(item))


def _add_speed_motor(system: System, motor: Motor) -> int:
    """Prescribe the angle or length, not its speed: integrating a speed would let it drift.

    A length is held along a slide's line; the slide itself does the rest.
    """
    start, prescribed = float(motor_place(motor, system.assembly.state.q)), motor.speed

    def place(_mbs: Any, time: float, _item: int, six: Any) -> Any:
        return offset(start + prescribed.integral(system.window.inside(time)), six)

    def speed(_mbs: Any, time: float, _item: int, six: Any) -> Any:
        return offset(prescribed.at(system.window.inside(time)), six)

    def offset(value: float, six: Any) -> Any:
        return [value, *six[1:]] if motor.slide else value

    functions = {"offsetUserFunction": place, "offsetUserFunction_t": speed}
    if motor.slide:
        item = items.ObjectJointGeneric(
            markerNumbers=system.slide_markers(motor.slide),
            constrainedAxes=[1, 0, 0, 0, 0, 0],
            offsetUserFunctionParameters=[0.0] * 6,
            **functions,
        )
    else:
        markers = [system.angle_marker(motor.first), system.angle_marker(motor.second)]
        item = items.ObjectConnectorCoordinate(markerNumbers=markers, **functions)
    return int(system.mbs.AddObject(item))


def _add_gear(system: System, gear: Gear) -> int:
    """Hold a sum of coordinates of up to three parts, as large as it is at the start.

    Exudyn's constraint has two ends: one is the ground, the other a body without mass that has the
    coordinates of all parts.

    Raises:
        NotRepresentableError: a rack slides on a moving body, or a part is in a beam.

    """
    q, places = system.assembly.state.q, system.assembly.state.places
    rows = constraints_at(system.mechanism, q, places)
    first = rows.first_rows[rows.names.index(gear.name)]
    parts = sorted({part for part in rows.parts[first].tolist() if part != GROUND})
    carried = any(tie.slide and tie.near.part != GROUND for tie in gear.ties)
    if carried or system.in_beams & set(parts):
        what = "no gear of a beam" if system.in_beams & set(parts) else "no rack on a moving body"
        message = f"Exudyn's own solver has {what}: take 'formulation: minimal'"
        raise NotRepresentableError(("joints", gear.name), message)
    row = rows.jacobian(np.array([first])).reshape(-1, 3)[parts].reshape(1, -1)
    whole = items.ObjectGenericODE2(
        nodeNumbers=[system.nodes[part] for part in parts],
        massMatrix=np.zeros((row.size, row.size)),
    )
    ground = items.MarkerNodeCoordinates(nodeNumber=system.ground_node)
    body = items.MarkerObjectODE2Coordinates(objectNumber=system.mbs.AddObject(whole))
    item = items.ObjectConnectorCoordinateVector(
        markerNumbers=[system.mbs.AddMarker(ground), system.mbs.AddMarker(body)],
        scalingMarker0=[],
        scalingMarker1=row,
        offset=[float(row[0] @ q[parts].ravel())],
    )
    return int(system.mbs.AddObject(item))


def _add_weight(system: System) -> None:
    gx, gy = system.mechanism.gravity
    for index, part in enumerate(system.mechanism.parts):
        if index in system.in_beams:
            continue
        marker = system.point_marker(Anchor(index, *part.centre))
        weight = [part.mass * gx, part.mass * gy, 0.0]
        system.mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=weight))
