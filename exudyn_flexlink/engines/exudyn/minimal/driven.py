"""Steps of runs in which drives decide on everything: nothing is solved for, all follows from time.

Such steps are as long as the drives are smooth, and nothing is left in them to be in error. What is
summed up over them, or looked for within, needs them shorter: they are cut at the samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import STAGES, C
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.radau import Step

FloatArray = NDArray[np.float64]


def cut(model: MinimalModel, step: Step, instants: FloatArray) -> list[Step]:
    """Return a step without independent coordinates as several, which end at instants (n,) s."""
    near = instant(step.end, EVENT_TIME)
    inner = instants[(instants > step.t + near) & (instants < step.end - near)]
    if not len(inner):
        return [step]
    edges = np.concatenate([[step.t], inner, [step.end]])
    lengths = np.diff(edges)
    times = (edges[:-1, None] + lengths[:, None] * C).ravel()
    nothing = np.zeros((len(times), 0))
    found = model.evaluate_all(times, nothing, nothing)
    begin, parts = step.begin, []
    for k, (t, h) in enumerate(zip(edges[:-1].tolist(), lengths.tolist(), strict=True)):
        stages = found.pick(slice(STAGES * k, STAGES * (k + 1)))
        parts.append(step._replace(t=t, h=h, begin=begin, stages=stages))
        begin = stages.pick(-1)
    return parts
