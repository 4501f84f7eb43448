"""What is said of steps in contact: of a step of the user's own, and of too few."""

from __future__ import annotations

ENOUGH_STEPS = 30  # per contact: restitution is then right to 1 %


def shortened(given: float, half_period: float, step: float) -> str:
    """Warn that contacts of half a period (s) were resolved by steps (s) of their own."""
    return (
        f"steps of {given:.3g} s would leave {half_period / given:.2g} for a contact: in contact "
        f"they were {step:.3g} s"
    )


def few_steps(steps: float) -> str:
    """Warn of few steps per contact."""
    return (
        f"{steps:.3g} steps per contact: below {ENOUGH_STEPS} the restitution is off by more than "
        "1 %; raise 'solver.steps_per_contact'"
    )
