"""Which instants of a run are kept: as many as its motion needs, where the scene does not say.

What is told of a run does not depend on them; figures, tables and comparisons at instants do.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, hypot, inf, isfinite, log10, pi, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.build_drives import steady_drive
from exudyn_flexlink.mechanism.channels import pairs
from exudyn_flexlink.mechanism.contacts import swings
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.scene import Scene

FEWEST = 2000  # of a run, however short: enough for any figure
PER_TURN = 500  # of a drive, or of what turns as the run starts
PER_SWING = 20  # of a struck lever on its springs, and of a pendulum as long as a part
LOOKS = 100  # at the speed of a drive, for its largest
UNKNOWN = 10  # times as many in a run that turns end before its time, nobody knows when
KEPT_MEMORY = 1e9  # bytes that samples may take where the scene does not say how many
BYTES_OF_SAMPLE, BYTES_OF_PART, BYTES_OF_PAIR, BYTES_OF_CONTACT = 1500, 250, 40, 100


def sample_times(scene: Scene, mechanism: Mechanism, end: float) -> FloatArray:
    """Even instants from 0 to the end, which is one of them, s."""
    interval = scene.run.sample or kept_interval(scene, mechanism, end)
    count = int(end / interval * (1 + 1e-12))
    grid = interval * np.arange(count + 1)
    # An end that is on the grid but for rounding takes the grid's place.
    return np.append(grid if end - grid[-1] > 1e-9 * interval else grid[:-1], end)


def sample_bytes(mechanism: Mechanism) -> int:
    """Memory that a sample takes until the run is saved, bytes: what both engines need at most.

    Measured from 10 to 40 rods, with and without walls, from one count of samples to another.
    """
    walls = sum(len(pairs(channel)) for channel in mechanism.channels)
    kept = BYTES_OF_PART * len(mechanism.parts) + BYTES_OF_PAIR * walls
    return BYTES_OF_SAMPLE + kept + BYTES_OF_CONTACT * len(mechanism.touching)


def kept_interval(scene: Scene, mechanism: Mechanism, end: float) -> float:
    """Time between samples, s, round: what the motion needs, or more if those were too many."""
    wanted = _round(wanted_interval(scene, mechanism, end), down=True)
    least = end * sample_bytes(mechanism) / KEPT_MEMORY
    return wanted if wanted >= least else _round(least, down=False)


def wanted_interval(scene: Scene, mechanism: Mechanism, end: float) -> float:
    """Time between samples, s, that shows the motion, as far as one knows before a run."""
    unknown = scene.run.turns is not None and steady_drive(scene, mechanism) is None
    needs = [end / (FEWEST * (UNKNOWN if unknown else 1)), *_needs(scene, mechanism, end)]
    return min(needs)


def _needs(scene: Scene, mechanism: Mechanism, end: float) -> Iterator[float]:
    looks = np.linspace(0.0, end, LOOKS)
    speeds = [
        float(np.abs(motor.speed.values(looks)).max())
        for motor in mechanism.speed_motors
        if motor.slide is None
    ]
    for speed in (*speeds, *scene.initial.speeds.values()):
        if speed:
            yield 2 * pi / abs(speed) / PER_TURN
    for swing in swings(mechanism).values():
        if isfinite(swing.time):
            yield 2 * pi * swing.time / PER_SWING
    weight = hypot(*mechanism.gravity)
    reach = min((part.reach for part in mechanism.parts if part.reach > 0), default=inf)
    if weight > 0 and isfinite(reach):
        yield 2 * pi * sqrt(reach / weight) / PER_SWING


def _round(interval: float, *, down: bool) -> float:
    """Return 1, 2 or 5 times a power of ten, next to an interval (s)."""
    power = 10.0 ** floor(log10(interval))
    steps = [float(f"{factor * power:.0e}") for factor in (1, 2, 5, 10)]
    fit = [step for step in steps if (step <= interval * (1 + 1e-9)) == down or step == interval]
    return max(fit) if down else min(fit)
