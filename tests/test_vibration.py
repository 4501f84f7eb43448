"""What holds of a run beyond its horizon: vibrations, and parts of the time in contact."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
import results

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.observables import spectrum, vibration


def shaken():
    """The paper's rigid link whose end vibrates in x by 2 mm rms, at 40 Hz."""
    run = results.rigid_link(turns=2.0, samples=4001)
    way = 2e-3 * sqrt(2) * np.sin(2 * pi * 40 * run.time)
    poses = run.poses.copy()
    poses[:, 1:11, 0] += way[:, None]
    rates = np.gradient(poses, run.time, axis=0)
    return replace(run, poses=poses, rates=rates)


def test_vibration_about_the_guides_axis():
    seen = vibration(shaken())
    assert seen.off_ideal
    # The end is measured from where the link's start, moved as well, is along the guide: what is
    # left of a motion along x is that across the guide, sin^2 of its angle in x.
    assert seen.rms[0] == pytest.approx(2e-3 * sqrt(3 / 8), rel=2e-2)
    assert seen.x.lines[0] == pytest.approx(40, abs=seen.x.resolution)


@pytest.mark.parametrize(("weak", "lines"), [(1e-3, (40, 90)), (1e-4, (40,))])
def test_weak_lines_are_not_named(weak, lines):
    time = np.linspace(0, 1.256, 4001)
    seen = spectrum(time, 2.8e-3 * np.sin(80 * pi * time) + weak * np.sin(180 * pi * time))
    assert seen.lines == pytest.approx(lines, abs=seen.resolution / 2)


def test_the_resolution_is_that_of_half_the_run():
    run = shaken()
    assert vibration(run).x.resolution == pytest.approx(2 / run.time[-1], rel=2e-2)


def test_only_what_both_runs_have_lived_through_counts():
    run = shaken()
    whole = compare(run, run).statistics()
    part = compare(results.first_samples(run, int(0.2 / run.time[-1] * 4000)), run).statistics()
    assert [own.levers["lever"][0] for own in part] == [0.0, 0.0]  # the first strike is at 0.314 s
    assert whole[0].levers["lever"][0] < -0.1
