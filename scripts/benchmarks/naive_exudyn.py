"""The strike of models/no_clearance.yaml, written by hand in Exudyn, without this package.

What an engineer who knows Exudyn writes for this one mechanism (n = 10 rods, hinges of `beam`
stiffness): rigid bodies with revolute joints, the slot as a constraint with Python functions, the
lever's contact as Python forces of an `ObjectGenericODE2` without mass, the index-3 generalised-
alpha solver with a sparse factorisation and one step for the whole run. All numbers are typed in.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, pi, sin, sqrt, tanh
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii  # noqa: N813 - as in Exudyn's own examples
import numpy as np

from exudyn_flexlink.arrays import FloatArray

DENSITY, YOUNG = 7850.0, 2e11  # kg/m^3, Pa
SPEED = 10.0  # rad/s, of the crank
LAP = 2 * pi / SPEED  # s
CRANK_X, LEVER_X = 0.02, -0.138  # m, on the x-axis
A, B, R = 0.04, 0.03, 0.03  # m: semi-axes of the ellipse, radius of the half circle

RODS, LINK = 10, 0.07
ROD = LINK / RODS  # m
ROD_MASS = DENSITY * 0.010 * 0.0005 * ROD
HINGE = YOUNG * 0.010 * 0.0005**3 / 12 / ROD  # N m/rad
HINGE_DAMPING = 2e-5  # N m s/rad

GUIDE, GUIDE_MASS = 0.09, DENSITY * 0.020 * 0.012 * 0.09
LEVER, LEVER_MASS = 0.03, DENSITY * 0.010 * 0.001 * 0.03
LEVER_INERTIA = LEVER_MASS * LEVER**2 / 3  # about its pivot
LEVER_SPRING = LEVER_INERTIA * (2 * pi * 40) ** 2
LEVER_DAMPING = 2 * 0.1 * sqrt(LEVER_SPRING * LEVER_INERTIA)

STIFFNESS, RESTITUTION, TRANSITION = 2e4, 0.5, 5e-3  # N/m, -, m/s
DEEPEST = -1e-3  # m: S deeper than this has fallen off the lever, and is below it
SAMPLE = 1e-3  # s


@dataclass(frozen=True)
class Motion:
    """S (N, 2) m and the lever's angle (N,) rad at instants (N,) s; steps of the solver."""

    time: FloatArray
    position: FloatArray
    lever_angle: FloatArray
    steps: int


def simulate_by_hand(step: float, end: float = 1.256) -> Motion:
    """Simulate up to `end` (s) with a fixed `step` (s)."""
    exu.config.printToConsole = False
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    sensors = _build(mbs)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = ceil(end / step - 1e-6)
    settings.timeIntegration.endTime = end
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.verboseMode = 0
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.9 * step
    mbs.SolveDynamic(settings)
    place, lever = (mbs.GetSensorStoredData(sensor) for sensor in sensors)
    # A step that Newton's method can't do is halved by the solver: steps need not fall on samples.
    time = np.arange(round(end / SAMPLE) + 1) * SAMPLE
    x, y, angle = (
        np.interp(time, place[:, 0], column) for column in (place[:, 1], place[:, 2], lever[:, 3])
    )
    return Motion(time, np.column_stack([x, y]), angle, len(place) - 1)


def _build(mbs: Any) -> tuple[int, int]:
    """Create everything; return the sensors of S and of the lever's angle."""
    ground = mbs.AddObject(eii.ObjectGround())
    fixed = mbs.AddNode(eii.NodePointGround())
    guide = _add_rod(mbs, CRANK_X, GUIDE, GUIDE_MASS)
    link = [_add_rod(mbs, A + i * ROD, ROD, ROD_MASS) for i in range(RODS)]
    lever = _add_rod(mbs, LEVER_X, LEVER, LEVER_MASS)
    bodies = {"ground": ground, "guide": guide[1], "lever": lever[1]}

    for name, x, length in (("guide", CRANK_X, GUIDE), ("lever", LEVER_X, LEVER)):
        _join(mbs, (bodies["ground"], x), (bodies[name], -length / 2))
    for one, other in pairwise(link):
        _join(mbs, (one[1], ROD / 2), (other[1], -ROD / 2))
        _spring(mbs, one[0], other[0], HINGE, HINGE_DAMPING)
    _spring(mbs, fixed, lever[0], LEVER_SPRING, LEVER_DAMPING)

    markers = [mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=b)) for b in (guide[1], link[0][1])]
    mbs.AddObject(
        eii.ObjectJointPrismatic2D(
            markerNumbers=markers, axisMarker0=[1, 0, 0], normalMarker1=[0, 1, 0]
        )
    )
    _add_motor(mbs, fixed, guide[0])
    _add_slot(mbs, fixed, link[0][0])
    mbs.AddObject(
        eii.ObjectGenericODE2(
            nodeNumbers=[link[-1][0], lever[0]],
            massMatrix=np.zeros((6, 6)),
            forceUserFunction=_strike,
        )
    )
    end = eii.SensorBody(
        bodyNumber=link[-1][1],
        localPosition=[ROD / 2, 0, 0],
        storeInternal=True,
        outputVariableType=exu.OutputVariableType.Position,
    )
    turned = eii.SensorNode(
        nodeNumber=lever[0],
        storeInternal=True,
        outputVariableType=exu.OutputVariableType.Coordinates,
    )
    return mbs.AddSensor(end), mbs.AddSensor(turned)


def _add_rod(mbs: Any, x: float, length: float, mass: float) -> tuple[int, int]:
    """Node and body of a rod along the x-axis from x on; it turns with the crank, or rests."""
    centre = x + length / 2
    turning = 0.0 if x < 0 else SPEED
    # At time 0 the link lies along the crank and moves with it: P at the ellipse's vertex.
    node = mbs.AddNode(
        eii.NodeRigidBody2D(
            referenceCoordinates=[centre, 0, 0],
            initialVelocities=[0, turning * (centre - CRANK_X), turning],
        )
    )
    body = mbs.AddObject(
        eii.ObjectRigidBody2D(mass=mass, inertia=mass * length**2 / 12, nodeNumber=node)
    )
    return node, body


def _join(mbs: Any, *ends: tuple[int, float]) -> None:
    markers = [
        mbs.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))
        for body, x in ends
    ]
    mbs.AddObject(eii.ObjectJointRevolute2D(markerNumbers=markers))


def _spring(mbs: Any, one: int, other: int, stiffness: float, damping: float) -> None:
    """Between the angles of two nodes; cheaper than a `TorsionalSpringDamper` between bodies."""
    mbs.AddObject(
        eii.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=_angles(mbs, one, other), stiffness=stiffness, damping=damping
        )
    )


def _angles(mbs: Any, *nodes: int) -> list[int]:
    """Markers of the angles of two nodes, or of the ground's zero."""
    return [
        mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=2)) for node in nodes
    ]


def _add_motor(mbs: Any, ground: int, node: int) -> None:
    mbs.AddObject(
        eii.ObjectConnectorCoordinate(
            markerNumbers=_angles(mbs, ground, node),
            offsetUserFunction=lambda _mbs, t, _item, _offset: SPEED * t,
            offsetUserFunction_t=lambda _mbs, _t, _item, _offset: SPEED,
        )
    )


# --- the slot: the start P of the first rod runs along the double track


def _add_slot(mbs: Any, ground: int, node: int) -> None:
    markers = [mbs.AddMarker(eii.MarkerNodeCoordinates(nodeNumber=n)) for n in (ground, node)]
    mbs.AddObject(
        eii.ObjectConnectorCoordinateVector(
            markerNumbers=markers,
            scalingMarker0=np.zeros((1, 3)),
            scalingMarker1=np.zeros((1, 3)),
            offset=[0.0],
            constraintUserFunction=_off_track,
            jacobianUserFunction=_off_track_gradient,
        )
    )


def _place_of_p(q: Any) -> tuple[float, float, float, float]:
    """P, and the half rod from it to the rod's centre; q are place and angle of that rod."""
    rx, ry = ROD / 2 * cos(q[2]), ROD / 2 * sin(q[2])
    return q[0] - rx, q[1] - ry, rx, ry


def _semi_axes(t: float, x: float) -> tuple[float, float]:
    """Of the ellipse in odd laps; in even laps the left half of the track is a circle."""
    return (R, R) if x < 0 and int(t / LAP) % 2 == 1 else (A, B)


def _off_track(_mbs: Any, t: float, _item: int, q: Any, _v: Any, _level: bool) -> list[float]:
    x, y, _, _ = _place_of_p(q[-3:])
    a, b = _semi_axes(t, x)
    return [(x / a) ** 2 + (y / b) ** 2 - 1]


def _off_track_gradient(
    _mbs: Any, t: float, _item: int, q: Any, _v: Any, _level: bool
) -> list[list[float]]:
    x, y, rx, ry = _place_of_p(q[-3:])
    a, b = _semi_axes(t, x)
    gx, gy = 2 * x / a**2, 2 * y / b**2
    return [[0.0] * (len(q) - 3) + [gx, gy, gx * ry - gy * rx]]


# --- the contact: the end S of the last rod on the upper face of the lever


def _strike(_mbs: Any, _t: float, _item: int, q: Any, v: Any) -> list[float]:
    """Forces on the last rod (x, y, angle) and on the lever (x, y, angle)."""
    rx, ry = ROD / 2 * cos(q[2]), ROD / 2 * sin(q[2])
    c, s = cos(q[5]), sin(q[5])
    # From the lever's centre to S, and how fast.
    dx = A + LINK - ROD / 2 + q[0] + rx - (LEVER_X + LEVER / 2 + q[3])
    dy = q[1] + ry - q[4]
    ux, uy = v[0] - v[2] * ry - v[3], v[1] + v[2] * rx - v[4]
    gap, place = c * dy - s * dx, c * dx + s * dy
    if not DEEPEST < gap < 0 or abs(place) > LEVER / 2:
        return [0.0] * 6
    closing = -(c * uy - s * ux - v[5] * place)
    e2 = RESTITUTION**2
    force = -STIFFNESS * gap * ((1 + e2) / 2 + (1 - e2) / 2 * tanh(closing / TRANSITION))
    fx, fy = -s * force, c * force
    return [fx, fy, rx * fy - ry * fx, -fx, -fy, -(dx * fy - dy * fx)]
