"""A mechanism at rest: where it stands, what its joints hold, small motions about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.constraints import Constraints
from exudyn_flexlink.mechanism.gears import tooth_pushes, without_teeth
from exudyn_flexlink.mechanism.kinematics import anchor_position
from exudyn_flexlink.mechanism.least_motion import within_body
from exudyn_flexlink.mechanism.mobility import shared_forces
from exudyn_flexlink.raising import Sendable


class NoRestError(Sendable, ValueError):
    """There is no rest near the start.

    Because of a `kind`: a "body", by its `name`, that a `force` (N) drives on and on; or a
    "contact" by impulse that would have to press.
    """

    def __init__(self, kind: str, name: str, force: float = 0.0) -> None:
        super().__init__(f"no rest is found: {kind} '{name}'")
        self.kind, self.name, self.force = kind, name, force


@dataclass(frozen=True)
class Rest:
    """Where all forces balance; SI units.

    `presses` (N; N m of a hinge's stop) are forces of the contacts that press, by name. Small
    motions go as exp(s t) with the `exponents` s (n,), undamped: purely imaginary where stable.
    `left` are the rates (1/s) at which the unstable balances grow that were found on the way here,
    and left.
    """

    assembly: Assembly
    joints: Constraints
    multipliers: FloatArray
    presses: Mapping[str, float]
    exponents: ComplexArray
    left: tuple[float, ...]

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies (n,) Hz of small motions about it, undamped; 0 of what nothing resists."""
        return np.sort(np.abs(self.exponents.imag)) / (2 * pi)

    @property
    def growth(self) -> float:
        """Rate (1/s) at which a small motion grows most; 0 if none does."""
        return float(np.abs(self.exponents.real).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether small motions stay small."""
        return self.growth == 0

    @property
    def poses(self) -> dict[str, FloatArray]:
        """By body [x, y, angle] (m, m, rad), of a flexible one those of its rods (rods, 3)."""
        q, bodies = self.assembly.state.q, self.assembly.mechanism.bodies.items()
        return {name: q[list(own)] if len(own) > 1 else q[own[0]] for name, own in bodies}

    @property
    def points(self) -> dict[str, FloatArray]:
        """Place [x, y] (m) of every point, by 'body.point'."""
        points = self.assembly.mechanism.points.items()
        return {name: anchor_position(own, self.assembly.state.q) for name, own in points}

    @property
    def forces(self) -> dict[str, FloatArray]:
        """Force [x, y] (N) in every joint, on the body of its second point."""
        pushes = self.joints.slopes[:, 1, :2] * self.multipliers[:, None]
        kinds, mechanism = ("revolute", "weld", "slide", "slot"), self.assembly.mechanism
        carried = {name: np.array([force]) for name, force in self.gears.items()}
        teeth = tooth_pushes(mechanism.gears, carried, self.assembly.state.q[None])
        return {
            name: without_teeth(name, pushes[rows].sum(axis=0)[None], teeth)[0]
            for name, rows in self._rows(*kinds)
        }

    @property
    def gears(self) -> dict[str, float]:
        """Tangential force (N) of gears, racks and belts, without pitch circles a torque (N m)."""
        return {name: self._last(rows) for name, rows in self._rows("gear")}

    @property
    def torques(self) -> dict[str, float]:
        """Torque (N m) of what can't turn, welds and slides, on the same body."""
        return {name: self._last(rows) for name, rows in self._rows("weld", "slide")}

    @property
    def drives(self) -> dict[str, float]:
        """What drives hold that prescribe motions, on the same body: N m, along a slide N."""
        return {name: self._last(rows) for name, rows in self._rows("drive", "slide drive")}

    def _last(self, rows: slice) -> float:
        return float(self.multipliers[rows][-1])

    def _rows(self, *kinds: str) -> list[tuple[str, slice]]:
        """Names and rows of joints or drives of some kinds, without those within bodies."""
        joints, mechanism = self.joints, self.assembly.mechanism
        starts = joints.first_rows.tolist()
        named = zip(joints.names, joints.kinds, starts, starts[1:], strict=False)
        return [
            (name, slice(first, last))
            for name, kind, first, last in named
            if kind in kinds and not within_body(mechanism, *joints.parts[first, :2].tolist())
        ]

    @property
    def notes(self) -> list[str]:
        """What has to be known of this rest, in sentences."""
        told = []
        if not self.stable:
            told.append(f"it is unstable: small motions grow by exp({self.growth:.4g} t/s)")
        elif self.left:
            told.append(
                f"an unstable rest was found first (it grows by exp({self.left[0]:.4g} t/s)), and "
                "left: guess other angles to take the other side"
            )
        if rubbing := [own.name for own in self.assembly.mechanism.frictions]:
            told.append(
                f"dry friction of {', '.join(rubbing)} would hold anywhere near, within its bound: "
                "this is where nothing has to"
            )
        if shared := shared_forces(self.assembly):
            told.append(f"forces in {', '.join(sorted(shared))} are not unique: the least are told")
        return told
