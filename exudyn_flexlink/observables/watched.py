"""The quantities whose extremes a run tells, as functions of poses and rates.

An engine asks it at the nodes of its steps: what is told of a run must not depend on its samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import Mechanism, anchor_position, anchor_velocity, turning
from exudyn_flexlink.observables.levers import angle_name, carrier_of, struck_bodies, struck_by
from exudyn_flexlink.observables.points import point_anchor, watched_point
from exudyn_flexlink.scene import Scene

FloatArray = NDArray[np.float64]


class Watched:
    """What is watched of a scene; `names` (k,) tell quantity and unit.

    Of every struck body the angle and its rate, of the watched point x, y, distance from O and
    speed; of `contacts`, those of joints with clearance among them, force and penetration, which an
    engine finds by itself.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        point, struck = watched_point(scene), struck_bodies(scene)
        self._anchor = point_anchor(scene, mechanism, point)
        self._hinged = []
        for contact in struck.values():
            part = struck_by(mechanism, contact).parts[1]
            self._hinged.append((part, carrier_of(scene, mechanism, mechanism.parts[part].body)[0]))
        places = [angle_name(body) for body in struck]
        places += [f"{point}.x_m", f"{point}.y_m", f"{point}.distance_m"]
        speeds = [f"{body}.rate_rad_per_s" for body in struck] + [f"{point}.speed_m_per_s"]
        self.names = (*places, *speeds)
        self.contacts = tuple(contact.name for contact in mechanism.touching)
        # Distance and speed are watched as squares, which are smooth even where they are 0.
        self._squared = (len(places) - 1, len(self.names) - 1)

    @staticmethod
    def of_contact(name: str) -> tuple[str, str]:
        """Names of a contact's force and penetration."""
        return f"{name}.force_N", f"{name}.penetration_m"

    def of(self, poses: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values at poses and rates (m, n, parts, 3): places, their rates, and speeds.

        (m, n, places) twice and (m, n, speeds), in the order of `names`; squared where `told` takes
        the root.
        """
        at = anchor_position(self._anchor, poses)
        going = anchor_velocity(self._anchor, poses, rates)
        angles, swinging = (
            [turning(carrier, part, x) for part, carrier in self._hinged] for x in (poses, rates)
        )
        distance, growing = np.sum(at * at, axis=-1), 2 * np.sum(at * going, axis=-1)
        speed = np.sum(going * going, axis=-1)
        return (
            np.stack([*angles, at[..., 0], at[..., 1], distance], axis=-1),
            np.stack([*swinging, going[..., 0], going[..., 1], growing], axis=-1),
            np.stack([*swinging, speed], axis=-1),
        )

    def told(self, which: int, values: FloatArray) -> FloatArray:
        """Values in the unit of their name."""
        return np.sqrt(np.maximum(values, 0.0)) if which in self._squared else values
