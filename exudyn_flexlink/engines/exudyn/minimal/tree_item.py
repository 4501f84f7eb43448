"""A layout as Exudyn's item of a tree: joints, and the bodies that they carry."""

from __future__ import annotations

from typing import Any

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
    bodies = (_body_of(mechanism, layout, link.parts) for link in links)
    masses, centres, inertias = zip(*bodies, strict=True)
    return {
        "jointTypes": [types[link.kind] for link in links],
        "linkParents": [link.parent for link in links],
        "jointTransformations": Engine.Matrix3DList([_turned(link.turn) for link in links]),
        "jointOffsets": Engine.Vector3DList([[*link.offset, 0.0] for link in links]),
        "linkInertiasCOM": Engine.Matrix3DList(
            [np.diag([0.0, 0.0, inertia]) for inertia in inertias]
        ),
        "linkCOMs": Engine.Vector3DList([[*centre, 0.0] for centre in centres]),
        "linkMasses": list(masses),
        "gravity": [*mechanism.gravity, 0.0],
        "jointPControlVector": springs[0],
        "jointDControlVector": springs[1],
        "jointPositionOffsetVector": springs[2],
        "jointVelocityOffsetVector": np.zeros(len(links)),
    }


def _body_of(
    mechanism: Mechanism, layout: TreeLayout, parts: tuple[int, ...]
) -> tuple[float, tuple[float, float], float]:
    """Mass (kg), centre (m, in the link's axes) and inertia about it (kg m^2) of parts as one."""
    masses = [mechanism.parts[part].mass for part in parts]
    total = sum(masses)
    if total == 0:
        return 0.0, (0.0, 0.0), 0.0
    centres = [layout.frames[part].place(*mechanism.parts[part].centre) for part in parts]
    weighted = list(zip(masses, centres, strict=True))
    x = sum(m * c[0] for m, c in weighted) / total
    y = sum(m * c[1] for m, c in weighted) / total
    inertia = sum(mechanism.parts[part].inertia for part in parts)
    inertia += sum(m * ((c[0] - x) ** 2 + (c[1] - y) ** 2) for m, c in weighted)
    return total, (x, y), inertia


def _turned(angle: float) -> FloatArray:
    """Rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
