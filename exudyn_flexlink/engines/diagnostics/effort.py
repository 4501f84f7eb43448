"""Where a run took much more work than its motion asks for."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import ImpulseLaw

MANY_ITERATIONS = 10  # of Newton's method a step: an accepted attempt takes 2 to 4
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
    rigid = {n for n, own in result.scene.contacts.items() if isinstance(own.law, ImpulseLaw)}
    for name, history in {**result.contacts, **result.bearings}.items():
        if name not in rigid and len(history.force) and history.force[-1] != 0:
            what = "joint" if name in result.bearings else "contact"
            yield (
                f"{what} '{name}' acted as the run was ended, which had made steps as short as "
                f"{shortest:.2g} s: less stiffness or friction, or a larger "
                "'transition_speed', make them longer"
            )
