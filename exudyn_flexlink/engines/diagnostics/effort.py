"""Where a run took much more work than its motion asks for, or kept fewer samples of it."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

from exudyn_flexlink.mechanism import build_mechanism, end_of_run, kept_interval, wanted_interval
from exudyn_flexlink.observables import crank_angle, crank_joint
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import ImpulseLaw

MANY_ITERATIONS = 10  # of Newton's method a step: an accepted attempt takes 2 to 4
FEW_SAMPLES = 100  # a turn: the chord between two is then 1/2000 of the radius off the circle
TINY_STEP = 1e-10  # s: ten thousand million steps for a second of motion lead nowhere soon


def many_iterations(result: Result) -> Iterator[str]:
    """Say that most steps were not solved at first: they were made shorter, and are no error."""
    checks = result.checks
    each = checks.newton_iterations / max(checks.steps, 1)
    if each > MANY_ITERATIONS:
        yield (
            f"Newton's method took {each:.2g} iterations a step, where 2 to 4 are usual: most "
            "steps were not solved at first, and made shorter; look for a contact, a bend of the "
            "track or a dead centre that asks for it"
        )


def tiny_steps(result: Result) -> Iterator[str]:
    """Name the contacts that asked for tiny steps when the user ended a run.

    Contacts by impulse ask for none: they have no stiffness.
    """
    shortest = result.checks.smallest_step
    if result.outcome.reason != INTERRUPTED or shortest > TINY_STEP:
        return
    rigid = {n for n, own in result.scene.all_contacts.items() if isinstance(own.law, ImpulseLaw)}
    for name, history in {**result.contacts, **result.bearings}.items():
        if name not in rigid and len(history.force) and history.force[-1] != 0:
            what = "joint" if name in result.bearings else "contact"
            yield (
                f"{what} '{name}' acted as the run was ended, which had made steps as short as "
                f"{shortest:.2g} s: less stiffness or friction, or a larger "
                "'transition_speed', make them longer"
            )


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
