"""Steps of runs in which drives decide on everything: nothing is solved for, all follows from time.

Such steps are as long as the drives are smooth, and nothing is left in them to be in error. What is
summed up over them, or looked for within, needs them shorter: they are cut at the samples.
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

AT_ONCE = 512  # parts of a step that are evaluated together: more take memory, and no less time


def cut(model: MinimalModel, step: Step, instants: FloatArray) -> Iterator[Step]:
    """Yield a step without independent coordinates as several.

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
        times = (begins[:, None] + lengths[:, None] * C).ravel()
        nothing = np.zeros((len(times), 0))
        found = model.evaluate_all(times, nothing, nothing)
        for i, (t, h) in enumerate(zip(begins.tolist(), lengths.tolist(), strict=True)):
            stages = found.pick(slice(STAGES * i, STAGES * (i + 1)))
            yield step._replace(t=t, h=h, begin=begin, stages=stages)
            begin = stages.pick(-1)
