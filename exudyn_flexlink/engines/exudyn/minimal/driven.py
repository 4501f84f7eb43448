"""Steps of runs in which drives decide on everything, or prescribe motions that vary.

Such motions follow from time: nothing is solved for in them, so that no error of theirs makes a
step short. What is summed up over steps, such as the work of the motor, or looked for within, needs
them shorter: they are cut at the samples.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import STAGES, C
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism import Ramp
from exudyn_flexlink.mechanism.tree import TreeLayout

AT_ONCE = 512  # parts of a step that are evaluated together: more take memory, and no less time


def shaken(layout: TreeLayout) -> bool:
    """Tell whether motors may do more within a step than its stages see.

    How far a motor turns within a step is limited where anything is solved for: that is enough for
    a constant speed and its ramp, but a motion may shake a little, fast.
    """
    return any(not isinstance(motor.speed, Ramp) for motor, _ in layout.motors.values())


def cut(model: MinimalModel, step: Step, instants: FloatArray) -> Iterator[Step]:
    """Yield a step as several, the states within it being those of its polynomial.

    They end at those of the `instants` (n,) s, increasing, that lie within.
    """
    near = instant(step.end, EVENT_TIME)
    first, last = np.searchsorted(instants, [step.t + near, step.end - near])
    if first == last:
        yield step
        return
    edges, begin = np.concatenate([[step.t], instants[first:last], [step.end]]), step.begin
    for k in range(0, len(edges) - 1, AT_ONCE):
        begins, lengths = edges[k:-1][:AT_ONCE], np.diff(edges[k:])[:AT_ONCE]
        times = begins[:, None] + lengths[:, None] * C
        times[:, -1] = edges[k + 1 :][:AT_ONCE]  # as they are given, not rounded
        times = times.ravel()
        found = model.evaluate_all(times, *step.at(times))
        accelerations = found.accelerations
        for i, (t, h) in enumerate(zip(begins.tolist(), lengths.tolist(), strict=True)):
            rows = slice(STAGES * i, STAGES * (i + 1))
            stages = found.pick(rows)
            yield step._replace(
                t=t, h=h, begin=begin, stages=stages, accelerations=accelerations[rows]
            )
            begin = stages.pick(-1)
