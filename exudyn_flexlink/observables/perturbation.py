"""How far a point is from where an ideal mechanism would have it."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Anchor, Mechanism, anchor_position, build_mechanism
from exudyn_flexlink.observables.interpolation import straight_between
from exudyn_flexlink.observables.points import path, point_anchor
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import FlexibleBody, RodBody, SleeveJoint, split_point


def perturbation(result: Result, point: str, time: FloatArray) -> FloatArray | None:
    """Distance (N, 2) m of 'body.point', in x and y, from its ideal place at instants (N,) s.

    That is on a straight link on the axis of its guide, see `on_axis`; None if there is none.

    Raises:
        ValueError: the scene has no such point.

    """
    ideal = on_axis(result, point)
    if ideal is None:
        return None
    return straight_between(result.time, path(result, point).position - ideal, time)


def on_axis(result: Result, point: str) -> FloatArray | None:
    """Where the end of a link would be, (N, 2) m, if it lay straight on the axis of its guide.

    Its start is taken where it is along the guide; what it and the link are off the axis, and what
    the link is bent, is what the place misses. None if the point is no end of a link in a guide.
    """
    body, inner = split_point(point)
    scene = result.scene
    spec = scene.bodies.get(body)
    joints = [
        name
        for name, joint in scene.joints.items()
        if isinstance(joint, SleeveJoint) and joint.link == body
    ]
    if not joints or inner != "end" or not isinstance(spec, (RodBody, FlexibleBody)):
        return None
    mechanism = build_mechanism(scene)
    guide = _guide(mechanism, joints[0])
    start = anchor_position(point_anchor(scene, mechanism, f"{body}.start"), result.poses)
    origin, angle = anchor_position(guide, result.poses), result.poses[:, guide.part, 2]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    reach = np.sum((start - origin) * along, axis=-1) + spec.length
    return np.asarray(origin + reach[:, None] * along)


def _guide(mechanism: Mechanism, joint: str) -> Anchor:
    """Anchor of a sleeve on its guide, whose x-axis is the guide's axis."""
    anchors = {slide.name: slide.first for slide in mechanism.slides}
    anchors |= {channel.name: channel.guide for channel in mechanism.channels}
    return anchors[joint]
