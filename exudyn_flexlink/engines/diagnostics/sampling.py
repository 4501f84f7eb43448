"""Whether the samples that were kept show the motion."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

from exudyn_flexlink.mechanism import build_mechanism, end_of_run, kept_interval, wanted_interval
from exudyn_flexlink.observables import crank_angle, crank_joint
from exudyn_flexlink.result import Result

FEW_SAMPLES = 100  # a turn: the chord between two is then 1/2000 of the radius off the circle


def few_samples(result: Result) -> Iterator[str]:
    """Say where samples are fewer than the motion asks for, or than turns that nobody foresaw."""
    scene, mechanism = result.scene, build_mechanism(result.scene)
    if scene.run.sample is not None:
        return
    end = end_of_run(scene, mechanism)
    kept, wanted = (of(scene, mechanism, end) for of in (kept_interval, wanted_interval))
    angle = crank_angle(result) if crank_joint(scene) else np.zeros(1)
    made = abs(float(angle[-1] - angle[0])) / (2 * pi)
    apart = f"samples are {kept:.3g} s apart"
    less = "figures and tables may show less of it, though peaks are right; see 'run.sample'"
    if kept > wanted * (1 + 1e-9):
        yield f"{apart}, since the run is long, where its motion asks for {wanted:.3g} s: {less}"
    elif made > 1 and result.outcome.time / kept < FEW_SAMPLES * made:
        yield f"{apart}, which is {result.outcome.time / kept / made:.3g} a turn: {less}"
