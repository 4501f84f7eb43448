"""What sweeps observe in tests: functions that other processes can import."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from small_scenes import PENDULUM, scene_from

from exudyn_flexlink.source import Document
from exudyn_flexlink.sweeps import grid, planned, work_of

LENGTH = "bodies.rod.length"


def plan_of(count):
    """Return a sweep over lengths 1, 2, .. m."""
    design = grid({LENGTH: list(range(1, count + 1))}, (), [])
    return planned(scene_from(PENDULUM), design, Document("test"))


def nothing(scene):
    raise AssertionError("nothing is to be simulated")


@dataclass(frozen=True)
class Length:
    """Observes the rod's length, after noting in a file that it was asked; may end its process.

    The process ends the first time that `deadly` is asked for, and whenever `always` is.
    """

    log: Path
    deadly: float = 0.0
    always: float = 0.0
    seconds: float = 0.0

    def __call__(self, scene, simulate):
        length = scene.bodies["rod"].length
        with self.log.open("a") as file:
            file.write(f"{length:g}\n")
        first = length == self.deadly and self.asked().count(length) == 1
        if first or length == self.always:
            os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(self.seconds)
        return {"length_m": length}

    def asked(self):
        """Lengths in the order in which they were asked for."""
        return list(map(float, self.log.read_text().split())) if self.log.exists() else []


def work(plan, observe):
    return work_of(plan, nothing, observe)
