"""How long a mechanism takes for a lap, and after how many laps it does the same again."""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm, pi

from exudyn_flexlink.observables import steady_speeds
from exudyn_flexlink.scene import LapsSpec, Scene, SlotJoint


class NoRhythmError(ValueError):
    """Nothing in the scene tells how long a lap takes; the text says what may be given."""


class ImpossibleLapsError(ValueError):
    """Laps so short, so long or so many that they can't be run; the text says which."""


@dataclass(frozen=True)
class Rhythm:
    """A `lap` takes so many s; after `laps` the mechanism is driven the same way again."""

    lap: float
    laps: int = 1

    @property
    def cycle(self) -> float:
        """Time (s) after which the mechanism is driven the same way again."""
        return self.laps * self.lap


def rhythm_of(scene: Scene, lap: float | None = None) -> Rhythm:
    """Return the rhythm of the first joint that a drive turns at one speed, or of a `lap` (s).

    Curves with laps tell how many laps make a cycle.
    """
    turned = list(steady_speeds(scene).values())
    if lap is None and not turned:
        raise NoRhythmError(
            "no drive turns a joint at one speed, so that nothing tells what a lap is: say how "
            "long it takes, such as the period of a force"
        )
    return Rhythm(2 * pi / abs(turned[0]) if lap is None else lap, laps_of_cycle(scene))


def laps_of_cycle(scene: Scene) -> int:
    """Laps after which the mechanism is driven the same way again: those of curves with laps."""
    slots = (joint for joint in scene.joints.values() if isinstance(joint, SlotJoint))
    curves = [scene.curves[slot.curve] for slot in slots]
    return lcm(*(len(own.curves) for own in curves if isinstance(own, LapsSpec)))
