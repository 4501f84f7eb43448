"""Flexible bodies as beams: their conditions, constants, shapes and items of Exudyn.

The link of an ideal sleeve is clamped at its start: the point lies on the guide's axis, and the
centre line is tangential to the axis. The start may run in a slot, and the ends may strike.
Anything else that a scene asks of a flexible body is refused by name.

The items are nodes with a slope, and cubic elements between them. Exudyn has geometrically exact
elements as well (``ObjectBeamGeometricallyExact2D``). They are linear between their nodes, so their
errors fall with the square of their number; those of cubic elements fall with the fourth power. The
end of a cantilever of the paper's link was pushed by 4.7 mm in 10 ms and then vibrated for 40 ms.
Four cubic elements had an error of 3.4e-6 m at 43 us per step, sixteen exact ones 3.7e-5 m at 77
us. Exact elements also need reference coordinates, which the native slot constraints do not allow.

The elements are those of Exudyn's ``ObjectANCFCable2D`` (absolute nodal coordinates): between two
nodes the centre line is the cubic through their positions and slopes, ``strain = |r'| - 1``,
``curvature = (r' x r'')/|r'|^2`` with respect to the unbent arc length. Energies are summed at the
points at which the element sums its forces, so that both balance: three Lobatto points for the
strain, two Gauss points for the curvature. Five and three points would be exact, but then an
element can't bend without stretching: with one to four elements, the end of a cantilever of the
paper's link, pushed by 5 mm, had 14 to 30 times the error at the same cost.

The controls of a beam are the positions and slopes of its nodes in turn, (2 nodes, 2): x and y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.mechanism import GROUND, Anchor, FaceContact, Mechanism, Placed, State, beam_of
from exudyn_flexlink.scene import FlexibleBody, Scene, SleeveJoint

LOBATTO = (np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6)
# Coefficients (powers, 4) of position and slope at both ends, in parts of an element of length 1.
CUBICS = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [-3, -2, 3, -1], [2, 1, -2, 1]])
GAUSS = (0.5 + np.array([-0.5, 0.5]) / 3**0.5, np.array([0.5, 0.5]))


@dataclass(frozen=True)
class Elastic:
    """Mass per length (kg/m), stiffnesses EA (N) and EI (N m^2), and the `lag` (s) of damping.

    Rates of strain and curvature are damped by ``lag EA`` and ``lag EI`` (Kelvin and Voigt).
    """

    mass: float
    axial: float
    bending: float
    lag: float


class CubicBeam:
    """A beam of a given length (m) with equal elements."""

    def __init__(self, length: float, elements: int, elastic: Elastic) -> None:
        self.length, self.elements, self.elastic = length, elements, elastic
        self.element = length / elements
        self.count = 2 * (elements + 1)  # controls
        strained, self._strain_weights = self._points(*LOBATTO)
        bent, self._bend_weights = self._points(*GAUSS)
        self._slope_where_strained = self._rows_of(strained, 1)
        self._slope_where_bent = self._rows_of(bent, 1)
        self._bend = self._rows_of(bent, 2)
        self.mass = self._mass_matrix()

    def rows(self, places: FloatArray, derivative: int = 0) -> FloatArray:
        """Matrix (places, controls) from controls to points, or slopes, at arc lengths (m)."""
        element = np.clip((places / self.element).astype(int), 0, self.elements - 1)
        return self._rows_of((element, places / self.element - element), derivative)

    def weight_rows(self) -> FloatArray:
        """Integrals over the length (controls,), m, from controls to the integral of points."""
        points, weights = np.polynomial.legendre.leggauss(2)
        shapes, spread = self._points((points + 1) / 2, weights / 2)
        return spread @ self._rows_of(shapes, 0)

    def kinetic(self, rates: FloatArray) -> FloatArray:
        """Kinetic energy (instants,), J, of rates (instants, controls, 2)."""
        return np.asarray(0.5 * np.einsum("nia,ij,nja->n", rates, self.mass, rates))

    def stored(self, controls: FloatArray) -> FloatArray:
        """Energy of stretching and bending (instants,) in J."""
        strain, curvature = self.strain(controls), self.curvature(controls)
        stretched = 0.5 * self.elastic.axial * strain**2 @ self._strain_weights
        return np.asarray(
            stretched + 0.5 * self.elastic.bending * curvature**2 @ self._bend_weights
        )

    def damping_power(self, controls: FloatArray, rates: FloatArray) -> FloatArray:
        """Power (instants,), W, that damping of strain and curvature dissipates; never negative."""
        if self.elastic.lag == 0:
            return np.zeros(len(controls))
        strain, curvature = self._strain_rate(controls, rates), self._bend_rate(controls, rates)
        stretched = self.elastic.axial * strain**2 @ self._strain_weights
        bent = self.elastic.bending * curvature**2 @ self._bend_weights
        return np.asarray(self.elastic.lag * (stretched + bent))

    def strain(self, controls: FloatArray) -> FloatArray:
        """Axial strain (instants, points)."""
        slope = self._slope_where_strained @ controls
        return np.hypot(slope[..., 0], slope[..., 1]) - 1

    def curvature(self, controls: FloatArray) -> FloatArray:
        """Curvature (instants, points) in 1/m."""
        slope, bend = self._slope_where_bent @ controls, self._bend @ controls
        return np.asarray(cross(slope, bend) / np.sum(slope**2, axis=-1))

    def _strain_rate(self, controls: FloatArray, rates: FloatArray) -> FloatArray:
        slope, rate = (self._slope_where_strained @ x for x in (controls, rates))
        return np.asarray(np.sum(slope * rate, axis=-1) / np.hypot(slope[..., 0], slope[..., 1]))

    def _bend_rate(self, controls: FloatArray, rates: FloatArray) -> FloatArray:
        slope, slope_rate = (self._slope_where_bent @ x for x in (controls, rates))
        bend, bend_rate = (self._bend @ x for x in (controls, rates))
        square = np.sum(slope**2, axis=-1)
        turned = cross(slope_rate, bend) + cross(slope, bend_rate)
        stretched = 2 * np.sum(slope * slope_rate, axis=-1) * cross(slope, bend) / square
        return np.asarray((turned - stretched) / square)

    def _points(
        self, part: FloatArray, weights: FloatArray
    ) -> tuple[tuple[IndexArray, FloatArray], FloatArray]:
        """Element, place within it, and weight (m) of every point of a quadrature rule."""
        element = np.repeat(np.arange(self.elements), len(part))
        return (element, np.tile(part, self.elements)), self.element * np.tile(
            weights, self.elements
        )

    def _rows_of(self, points: tuple[IndexArray, FloatArray], derivative: int) -> FloatArray:
        element, part = points
        rows = np.zeros((len(part), self.count))
        for k, values in enumerate(_hermite(part, self.element, derivative)):
            rows[np.arange(len(part)), 2 * element + k] = values
        return rows

    def _mass_matrix(self) -> FloatArray:
        """Consistent mass matrix (controls, controls) in kg, kg m, kg m^2; the same for x and y."""
        points, weights = np.polynomial.legendre.leggauss(4)
        shapes, spread = self._points((points + 1) / 2, weights / 2)
        rows = self._rows_of(shapes, 0)
        return np.asarray(self.elastic.mass * (rows.T * spread) @ rows)


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product of plane vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _hermite(x: FloatArray, length: float, derivative: int) -> FloatArray:
    """Cubics (4, points) of position and slope at both ends of an element, at its places x."""
    slopes = polynomial.polyder(CUBICS, derivative) / length**derivative
    sizes = np.array([[1.0], [length], [1.0], [length]])
    return np.asarray(sizes * polynomial.polyval(x, slopes))


Refusal = tuple[tuple[str, ...], str]
"""Path of an item of the scene that a beam does not allow, and the reason."""

ELEMENTS = 2  # by default


@dataclass(frozen=True)
class BeamLink:
    """A flexible body as a beam that replaces the parts `rods`, of given `lengths` (m).

    A Result still has the rods, as chords between points of the beam. The beam starts on the axis
    of the part `guide`.
    """

    body: str
    rods: tuple[int, ...]
    lengths: tuple[float, ...]
    guide: int
    shape: CubicBeam

    @property
    def start(self) -> Anchor:
        """Start of the beam, as an anchor of its first rod."""
        return Anchor(self.rods[0], 0.0, 0.0)

    @property
    def end(self) -> Anchor:
        """End of the beam, as an anchor of its last rod."""
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
    """Return the mechanism with beams' rods without mass and hinges."""
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
    pose, moved = state.q[beam.rods[0]], state.v[beam.rods[0]]
    along = np.array([np.cos(pose[2]), np.sin(pose[2])])
    turned = moved[2] * np.array([-along[1], along[0]])
    places = np.linspace(0, beam.shape.length, beam.shape.elements + 1)[:, None]
    controls = np.zeros((2, beam.shape.count, 2))
    controls[0, ::2], controls[0, 1::2] = pose[:2] + places * along, along
    controls[1, ::2], controls[1, 1::2] = moved[:2] + places * turned, turned
    return controls[0], controls[1]


def add_beam(mbs: Any, beam: BeamLink, state: State) -> tuple[list[int], list[int]]:
    """Add nodes and elements, unbent as at time 0; return their numbers."""
    shape, elastic = beam.shape, beam.shape.elastic
    states = (x.reshape(-1, 4).tolist() for x in straight(beam, state))
    nodes = [
        mbs.AddNode(
            items.NodePoint2DSlope1(
                referenceCoordinates=[0.0] * 4, initialCoordinates=place, initialVelocities=moved
            )
        )
        for place, moved in zip(*states, strict=True)
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
                # Strain at three Lobatto points, curvature at two Gauss points: see `beam`.
                useReducedOrderIntegration=2,
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
    # The torque of a hinge with damping d is d times the rate of its angle. The angle is spread
    # over a cell of length l, so the damping of a beam's curvature is d l.
    lag = body.hinges.damping * (body.length / body.rods) / beam.bending_stiffness
    elastic = Elastic(beam.mass_per_length, axial, beam.bending_stiffness, lag)
    shape = CubicBeam(beam.length, scene.solver.elements or ELEMENTS, elastic)
    lengths = tuple(2 * mechanism.parts[rod].centre[0] for rod in rods)
    return BeamLink(name, rods, lengths, guide, shape)


def _lacking_of_body(name: str, body: FlexibleBody) -> Iterator[Refusal]:
    path, stiffness = ("bodies", name), body.hinges.stiffness
    if stiffness != "beam":
        why = f"'{stiffness}' is no beam's: with formulation beam it must be 'beam'"
        yield (*path, "hinges", "stiffness"), why
    if not body.slender:
        why = "the elements have no inertia of the section; with formulation beam it must be true"
        yield (*path, "slender"), why
    if body.stretch:
        yield (*path, "stretch"), "a beam stretches anyhow: leave it out"
    if body.rods < 2:
        yield (*path, "rods"), "a beam is shown by its chords: at least two"


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
        path = "contacts", contact.name
        point = contact.point if isinstance(contact, FaceContact) else None
        if point and point.part in rods and point not in ends:
            yield (*path, "point"), "a beam strikes with its ends alone"
        if set(contact.parts[1:] if point else contact.parts) & set(rods):
            yield (
                (*path, "line") if point else path,
                "a beam strikes with its end; nothing meets it",
            )


def _lacking_points(
    mechanism: Mechanism, rods: tuple[int, ...], ends: tuple[Anchor, Anchor]
) -> Iterator[Refusal]:
    """Refuse springs, forces and senses within a beam, and forces in its axes."""

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
