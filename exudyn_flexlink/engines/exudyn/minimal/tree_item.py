"""A layout as Exudyn's item of a tree: joints, and the bodies that they carry."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.engine import Engine
from exudyn_flexlink.mechanism import Mechanism
from exudyn_flexlink.mechanism.tree import ALONG_X, ALONG_Y, HINGE, TreeLayout


def tree_item(
    mechanism: Mechanism, layout: TreeLayout, springs: tuple[FloatArray, FloatArray, FloatArray]
) -> dict[str, Any]:
    """Arguments of the item but for its node; `springs` are stiffness, damping, rest by link."""
    types = {
        HINGE: Engine.JointType.RevoluteZ,
        ALONG_X: Engine.JointType.PrismaticX,
        ALONG_Y: Engine.JointType.PrismaticY,
    }
    links = layout.links
    bodies = [_body_of(mechanism, layout, link.parts) for link in links]
    return {
        "jointTypes": [types[link.kind] for link in links],
        "linkParents": [link.parent for link in links],
        "jointTransformations": Engine.Matrix3DList([_turned(link.turn) for link in links]),
        "jointOffsets": Engine.Vector3DList([[*link.offset, 0.0] for link in links]),
        "linkInertiasCOM": Engine.Matrix3DList(
            [np.diag([0.0, 0.0, body.inertia]) for body in bodies]
        ),
        "linkCOMs": Engine.Vector3DList([[*body.centre, 0.0] for body in bodies]),
        "linkMasses": [body.mass for body in bodies],
        "gravity": [*mechanism.gravity, 0.0],
        "jointPControlVector": springs[0],
        "jointDControlVector": springs[1],
        "jointPositionOffsetVector": springs[2],
        "jointVelocityOffsetVector": np.zeros(len(links)),
    }


class _Body(NamedTuple):
    """Mass (kg), centre of mass (m, in the link's axes) and inertia about it (kg m^2)."""

    mass: float
    centre: tuple[float, float]
    inertia: float


def _body_of(mechanism: Mechanism, layout: TreeLayout, parts: tuple[int, ...]) -> _Body:
    """Rigid parts that move as one."""
    masses = [mechanism.parts[part].mass for part in parts]
    total = sum(masses)
    if total == 0:
        return _Body(0.0, (0.0, 0.0), 0.0)
    centres = [layout.frames[part].place(*mechanism.parts[part].centre) for part in parts]
    weighted = list(zip(masses, centres, strict=True))
    x = sum(m * c[0] for m, c in weighted) / total
    y = sum(m * c[1] for m, c in weighted) / total
    inertia = sum(mechanism.parts[part].inertia for part in parts)
    inertia += sum(m * ((c[0] - x) ** 2 + (c[1] - y) ** 2) for m, c in weighted)
    return _Body(total, (x, y), inertia)


def _turned(angle: float) -> FloatArray:
    """Rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
