"""The quantities whose extremes a run tells, as functions of poses and rates.

An engine asks it at the nodes of its steps: what is told of a run must not depend on its samples.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Mechanism, anchor_position, anchor_velocity
from exudyn_flexlink.observables.answers import ANGLE, answer_of, measures
from exudyn_flexlink.observables.levers import struck_bodies, struck_by
from exudyn_flexlink.observables.points import point_anchor, watched_point
from exudyn_flexlink.scene import Scene


def extremes_of(scene: Scene, contact: str) -> tuple[str, str]:
    """Names of the force and penetration of a contact, or of what a hinge's stop has of both."""
    turns = scene.unit_of(contact, "m") == "rad"
    names = ("torque_N_m", "penetration_rad") if turns else ("force_N", "penetration_m")
    return f"{contact}.{names[0]}", f"{contact}.{names[1]}"


class Watched:
    """What is watched of a scene, whose parts are at `start` (parts, 3) at time 0.

    Of every struck body its angle or displacement and the rate of that, of the watched point x, y,
    distance from O and speed; of `contacts`, those of joints with clearance among them, force and
    penetration, which an engine finds by itself. `names` (k,) tell quantity and unit.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism, start: FloatArray) -> None:
        self._scene, point, told = scene, watched_point(scene), measures(scene).items()
        self._anchor = point_anchor(scene, mechanism, point)
        self._answers = [
            answer_of(scene, mechanism, struck_by(mechanism, contact), start)
            for contact in struck_bodies(scene).values()
        ]
        places = [f"{body}.{measure.name}" for body, measure in told]
        places += [f"{point}.x_m", f"{point}.y_m", f"{point}.distance_m"]
        speeds = [f"{body}.{measure.rate_name}" for body, measure in told]
        self.names = (*places, *speeds, f"{point}.speed_m_per_s")
        self.contacts = tuple(contact.name for contact in mechanism.touching)
        # Distance and speed are watched as squares, which are smooth even where they are 0.
        self._squared = (len(places) - 1, len(self.names) - 1)

    def of_contact(self, name: str) -> tuple[str, str]:
        """Names of a contact's force and penetration: see `extremes_of`."""
        return extremes_of(self._scene, name)

    def of(
        self, poses: FloatArray, rates: FloatArray, slopes: Callable[[FloatArray], FloatArray]
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Values at poses and rates (m, n, parts, 3): places, their rates, speeds, their slopes.

        (m, n, places) twice and (m, n, speeds) twice, in the order of `names`; squared where `told`
        takes the root. `slopes` differentiates velocities (m, n, c) within a step.
        """
        at = anchor_position(self._anchor, poses)
        going = anchor_velocity(self._anchor, poses, rates)
        motions = [own.motion(poses, rates) for own in self._answers]
        answers, moving = [own[0] for own in motions], [own[1] for own in motions]
        distance, growing = np.sum(at * at, axis=-1), 2 * np.sum(at * going, axis=-1)
        velocities = np.stack([*moving, going[..., 0], going[..., 1]], axis=-1)
        slope = slopes(velocities)
        # The square has twice the degree of the velocity: its values alone do not tell its slope.
        square = np.sum(going * going, axis=-1)
        bend = 2 * np.sum(going * slope[..., -2:], axis=-1)
        return (
            np.stack([*answers, at[..., 0], at[..., 1], distance], axis=-1),
            np.stack([*moving, going[..., 0], going[..., 1], growing], axis=-1),
            np.concatenate([velocities[..., :-2], square[..., None]], axis=-1),
            np.concatenate([slope[..., :-2], bend[..., None]], axis=-1),
        )

    def sizes(self, poses: FloatArray) -> FloatArray:
        """Sizes (places,) of what the places are differences of, at poses (m, n, parts, 3).

        They have the rounding of these: a length that of the farthest one, an angle that of the
        largest, but of a radian at least, as sines and cosines have it.
        """
        ends = poses[..., :2], anchor_position(self._anchor, poses)
        far = max(float(np.abs(end).max()) for end in ends)
        angle = max(float(np.abs(poses[..., 2]).max()), 1.0)
        answers = [angle if own.measure is ANGLE else far for own in self._answers]
        return np.array([*answers, far, far, far**2])

    def told(self, which: int, values: FloatArray) -> FloatArray:
        """Values in the unit of their name."""
        return np.sqrt(np.maximum(values, 0.0)) if which in self._squared else values
