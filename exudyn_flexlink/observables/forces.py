"""Forces of a run by quantity and name, and how far they are from those of another run.

Forces are known worse than the positions that they belong to: where positions err by a vibration,
forces err by that times the square of its frequency. So they have errors of their own. N is the
number of instants.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.measured_error import ForceDeviation, ForceSpread
from exudyn_flexlink.observables.parting import common_times
from exudyn_flexlink.observables.points import straight_between
from exudyn_flexlink.observables.touching import sleeves_with_play
from exudyn_flexlink.result import Result

Pair = tuple[str, str]

NEGLIGIBLE = 1e-6  # of the largest force of its unit: of a smaller one no part is told
NO_FORCE = 1e-12  # N or N m: likewise, as it is rounding


@dataclass(frozen=True)
class Force:
    """A force at a run's samples: `values` (N,), or (N, 2) of a vector, in `unit`, N or N m."""

    quantity: str
    name: str
    unit: str
    values: FloatArray

    @property
    def size(self) -> FloatArray:
        """Length of the vector (N,); what is no vector keeps its sign."""
        if self.values.ndim == 1:
            return self.values
        return np.asarray(np.linalg.norm(self.values, axis=-1))


@dataclass(frozen=True)
class ForcePeak:
    """The largest of a force in `unit`, N or N m, and its instant `at` (s)."""

    value: float
    unit: str
    at: float


def forces_of(result: Result) -> dict[str, Force]:
    """Torques and forces of drives; forces of slots, joints, springs, walls and contacts; by name.

    Without the hinges inside a flexible body.
    """
    joints = {n: force for n, force in result.joint_forces.items() if n in result.scene.joints}
    kinds: tuple[tuple[str, str, Mapping[str, FloatArray]], ...] = (
        ("drive torque", "N m", result.drive_torques),
        ("drive force", "N", result.drive_forces),
        ("slot force", "N", result.slot_forces),
        ("joint force", "N", joints),
        ("spring force", "N", result.spring_forces),
        ("wall force", "N", _wall_forces(result)),
        ("contact force", "N", {name: own.force for name, own in result.contacts.items()}),
    )
    return {
        f"{quantity} of {name}": Force(quantity, name, unit, values)
        for quantity, unit, found in kinds
        for name, values in found.items()
    }


def _wall_forces(result: Result) -> dict[str, FloatArray]:
    """Force of each wall on the link, the sum over all that touches it, where there is play."""
    found = {}
    for joint in sleeves_with_play(result):
        history = result.sleeves[joint]
        for side, wall in ((1.0, "upper"), (-1.0, "lower")):
            own = np.array(history.sides) == side
            found[f"{joint}, {wall} wall"] = history.force[:, own].sum(axis=1)
    return found


def force_peaks(result: Result) -> dict[str, ForcePeak]:
    """Largest of every force of a run, by its name: of contacts at any time, of others at samples.

    A contact with impulses is left out: their force has no bound.
    """
    unbound = {
        f"contact force of {name}"
        for name, own in result.contacts.items()
        if not np.isfinite(own.touches.peak_force).all()
    }
    exact = {
        f"contact force of {name}": result.extremes[f"{name}.force_N"].greatest
        for name, own in result.contacts.items()
        if len(result.extremes[f"{name}.force_N"].time)
    }
    found = {}
    for name, force in forces_of(result).items():
        largest = int(np.argmax(np.abs(force.size)))
        value, at = exact.get(name, (float(force.size[largest]), float(result.time[largest])))
        if name not in unbound:
            found[name] = ForcePeak(value, force.unit, at)
    return found


def force_deviations(
    first: Result, second: Result, until: float = inf
) -> dict[str, ForceDeviation]:
    """How far forces of two runs are apart before `until` (s), by what they are called.

    At the instants that the first run's scene asks for. Left out are those at which one run touches
    what the other does not, or that are next to an impulse: there a force is the contact's or not,
    as much as both runs differ in its instant, which says nothing about the size of any force.
    """
    time = common_times(first, second)
    spacing = float(np.max(np.diff(time), initial=0.0))
    time = time[time < until]
    alike, in_touch = _touching(first, second, time)
    alike &= time > 0  # both begin with one state
    alike &= ~(_near_impulses(first, time, spacing) | _near_impulses(second, time, spacing))
    both = forces_of(first), forces_of(second)
    found = {}
    for name, force in both[0].items():
        if name not in both[1]:
            continue
        one, other = (
            straight_between(run.time, own[name].values, time)
            for run, own in zip((first, second), both, strict=True)
        )
        parts = (_spread(time, one, other, alike & part) for part in (~in_touch, in_touch))
        found[name] = ForceDeviation(force.unit, *parts)
    return found


def worst_force(found: Mapping[str, ForceDeviation]) -> tuple[str, float]:
    """Name of the force that is farthest off as a part of its own largest, and that part.

    While nothing touches, unless something does throughout. Forces that are rounding, beside the
    largest of their unit, tell nothing. An empty name and 0 where no force does.
    """
    parts = {name: own.free or own.touching for name, own in found.items()}
    sizes: dict[str, float] = {}
    for name, part in parts.items():
        unit = found[name].unit
        sizes[unit] = max(sizes.get(unit, NO_FORCE), part.size if part else 0.0)
    told = {
        name: part.relative
        for name, part in parts.items()
        if part and part.size > max(NO_FORCE, NEGLIGIBLE * sizes[found[name].unit])
    }
    return max(told.items(), key=lambda item: item[1], default=("", 0.0))


def _spread(
    time: FloatArray, one: FloatArray, other: FloatArray, part: BoolArray
) -> ForceSpread | None:
    if not part.any():
        return None
    one, other = (values[part].reshape(int(part.sum()), -1) for values in (one, other))
    apart = np.linalg.norm(one - other, axis=1)
    size = max(float(np.linalg.norm(values, axis=1).max()) for values in (one, other))
    worst = int(apart.argmax())
    rms = float(np.sqrt(np.mean(apart**2)))
    return ForceSpread(float(apart[worst]), float(time[part][worst]), rms, size)


def touching(result: Result, time: FloatArray) -> BoolArray:
    """Whether anything touches, a contact or a wall, at instants (N,) s."""
    return _any(time, list(_pairs(result, time).values()))


def _touching(first: Result, second: Result, time: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Whether the same touches in both runs, of what can touch in both; whether anything does."""
    both = _pairs(first, time), _pairs(second, time)
    common = [pair for pair in both[0] if pair in both[1]]
    parted = [both[0][pair] != both[1][pair] for pair in common]
    return ~_any(time, parted), touching(first, time) | touching(second, time)


def _any(time: FloatArray, masks: Sequence[BoolArray]) -> BoolArray:
    return np.asarray(np.any([np.zeros(len(time), dtype=bool), *masks], axis=0))


def _pairs(result: Result, time: FloatArray) -> dict[Pair, BoolArray]:
    """Whether each pair of what can touch does, at instants (N,) s."""
    found = {}
    for name, touches in result.intervals.items():
        pairs = result.sleeves[name].pairs if name in result.sleeves else (name,)
        for k, pair in enumerate(pairs):
            found[name, pair] = touches.where(touches.pair == k).lasting(time) > 0
    return found


def _near_impulses(result: Result, time: FloatArray, spacing: float) -> BoolArray:
    """Whether an impulse is within a spacing of instants (N,), s."""
    near = np.zeros(len(time), dtype=bool)
    for touches in result.intervals.values():
        hits = np.sort(touches.begin[np.isinf(touches.peak_force)])
        count = [np.searchsorted(hits, time + off) for off in (-spacing, spacing)]
        near |= count[1] > count[0]
    return near
