"""Where the links of a tree are: from its coordinates to the poses of parts, for many instants."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import GROUND, Assembly
from exudyn_flexlink.mechanism.tree import ALONG_X, HINGE, ROOT, TreeLayout

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Motions:
    """Parts at many instants, (instants, parts, 3) each: x, y (m), angle (rad) of the origins."""

    poses: FloatArray
    rates: FloatArray
    bends: FloatArray  # second derivatives


def start_coordinates(layout: TreeLayout, assembly: Assembly) -> tuple[FloatArray, FloatArray]:
    """Coordinates and speeds of the tree (links,) at time 0."""
    q, v = assembly.state.q, assembly.state.v
    x, rate = np.zeros(len(layout.links)), np.zeros(len(layout.links))
    ground = np.zeros(3)
    for i, link in enumerate(layout.links):
        if link.part is None:
            continue
        above = None if link.parent == ROOT else layout.links[link.parent]
        if above is not None and above.part is None:
            # A free part: its two slides are its place, from which its own frame does not differ.
            x[i - 2 : i + 1], rate[i - 2 : i + 1] = q[link.part], v[link.part]
            continue
        near, far = GROUND if above is None else above.part, link.part
        pose, speed = (ground, ground) if near == GROUND else (q[near], v[near])
        if link.kind == HINGE:
            x[i], rate[i] = q[far, 2] - pose[2], v[far, 2] - speed[2]
            continue
        x[i], rate[i] = _slid(layout, i, (pose, speed), (q[far], v[far]))
    return x, rate


def _slid(
    layout: TreeLayout,
    i: int,
    near: tuple[FloatArray, FloatArray],
    far: tuple[FloatArray, FloatArray],
) -> tuple[float, float]:
    """How far a part has slid along the x-axis of the one before, and how fast."""
    link = layout.links[i]
    base = (0.0, 0.0) if link.parent == ROOT else layout.links[link.parent].origin
    at, going = _carried(far, link.origin)
    from_, moving = _carried(near, (base[0] + link.offset[0], base[1] + link.offset[1]))
    along = np.array([np.cos(near[0][2]), np.sin(near[0][2])])
    across = np.array([-along[1], along[0]])
    between = at - from_
    return float(along @ between), float(along @ (going - moving) + near[1][2] * (across @ between))


def _carried(
    state: tuple[FloatArray, FloatArray], point: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Place and velocity of a point of a part in a state (pose, rate)."""
    pose, rate = state
    c, s = np.cos(pose[2]), np.sin(pose[2])
    arm = np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])
    return pose[:2] + arm, rate[:2] + rate[2] * np.array([-arm[1], arm[0]])


class Reaches:
    """How the coordinates of a tree move the far ends of its parts."""

    def __init__(self, layout: TreeLayout, reach: list[float]) -> None:
        self._links = [(link.parent, link.kind, *link.offset) for link in layout.links]
        self._carriers = np.array([layout.of_part[part] for part in range(len(reach))], dtype=int)
        self._origins = np.array([layout.links[i].origin[0] for i in self._carriers])
        self._reach = np.array(reach)
        above = np.zeros((len(layout.links), len(reach)), dtype=bool)
        for part, carrier in enumerate(self._carriers):
            above[layout.path(int(carrier)), part] = True
        hinges = np.array([link.kind == HINGE for link in layout.links])
        self._turning, self._sliding = above & hinges[:, None], above & ~hinges[:, None]

    def moves(self, x: FloatArray) -> FloatArray:
        """Derivatives (links, 2 parts) of all ends' x, then of their y, at coordinates (links,)."""
        places: list[tuple[float, float, float, float]] = []  # x, y, cos, sin of each link
        for (parent, kind, ox, oy), moved in zip(self._links, x.tolist(), strict=True):
            px, py, c, s = places[parent] if parent != ROOT else (0.0, 0.0, 1.0, 0.0)
            px, py = px + c * ox - s * oy, py + s * ox + c * oy
            if kind == HINGE:
                turn_c, turn_s = cos(moved), sin(moved)
                places.append((px, py, c * turn_c - s * turn_s, s * turn_c + c * turn_s))
                continue
            ex, ey = (c, s) if kind == ALONG_X else (-s, c)
            places.append((px + moved * ex, py + moved * ey, c, s))
        frames = np.array(places)
        ahead = self._reach - self._origins
        at = frames[self._carriers]
        ends = at[:, :2] + ahead[:, None] * at[:, 2:]
        arm_x = ends[:, 0] - frames[:, None, 0]
        arm_y = ends[:, 1] - frames[:, None, 1]
        return np.hstack([
            np.where(self._turning, -arm_y, self._sliding),
            np.where(self._turning, arm_x, self._sliding),
        ])  # fmt: skip


def motions(layout: TreeLayout, x: FloatArray, v: FloatArray, a: FloatArray) -> Motions:
    """Poses of all parts at coordinates, speeds and accelerations (instants, links)."""
    shape = (len(x), len(layout.of_part), 3)
    found = Motions(np.zeros(shape), np.zeros(shape), np.zeros(shape))
    frames: list[FloatArray] = []  # of each link: (3, instants, 3), pose, rate and bend
    still = np.zeros((3, len(x), 3))
    for i, link in enumerate(layout.links):
        parent = still if link.parent == ROOT else frames[link.parent]
        moved = np.array([x[:, i], v[:, i], a[:, i]])
        frame = _shifted(parent, link.offset)
        if link.kind == HINGE:
            frame = frame.copy()
            frame[:, :, 2] += moved
        else:
            frame = _slide(frame, moved, 0.0 if link.kind == ALONG_X else np.pi / 2)
        frames.append(frame)
        if link.part is not None:
            own = _shifted(frame, (-link.origin[0], -link.origin[1]))
            for kind, values in zip((found.poses, found.rates, found.bends), own, strict=True):
                kind[:, link.part] = values
    return found


def _shifted(frame: FloatArray, point: tuple[float, float]) -> FloatArray:
    """Frame (3, instants, 3) moved to a point in its own axes."""
    pose, rate, bend = frame
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    ax, ay = c * point[0] - s * point[1], s * point[0] + c * point[1]
    turning, bending = rate[:, 2], bend[:, 2]
    moved = frame.copy()
    moved[0, :, 0] += ax
    moved[0, :, 1] += ay
    moved[1, :, 0] -= turning * ay
    moved[1, :, 1] += turning * ax
    moved[2, :, 0] -= bending * ay + turning**2 * ax
    moved[2, :, 1] += bending * ax - turning**2 * ay
    return np.asarray(moved)


def _slide(frame: FloatArray, moved: FloatArray, turn: float) -> FloatArray:
    """Frame moved along its x-axis turned by `turn`; `moved` (3, instants) with its derivatives."""
    angle, turning, bending = frame[0, :, 2] + turn, frame[1, :, 2], frame[2, :, 2]
    ex, ey = np.cos(angle), np.sin(angle)
    s, rate, bend = moved
    result = frame.copy()
    result[0, :, 0] += s * ex
    result[0, :, 1] += s * ey
    result[1, :, 0] += rate * ex - turning * s * ey
    result[1, :, 1] += rate * ey + turning * s * ex
    along, across = bend - turning**2 * s, 2 * turning * rate + bending * s
    result[2, :, 0] += along * ex - across * ey
    result[2, :, 1] += along * ey + across * ex
    return np.asarray(result)
