"""Friction in the impact of one contact, by Coulomb: both impulses grow together until it is over.

With the inverse masses k_t, k_n and k_tn at the contact, slip u and rate w of the gap follow

    u = u_a + k_t P_t + k_tn P_n,      w = w_a + k_n P_n + k_tn P_t

as P_n grows (E. J. Routh, *Dynamics of a System of Rigid Bodies*, part 1, 1897; Y. Wang and
M. T. Mason, J. Appl. Mech. 59 (1992) 635). While it slides dP_t = -mu sgn(u) dP_n; where u comes to
zero it sticks if friction is enough, and else slides back. The gap closes until w = 0, at P_c, and
the touch is over at (1 + e) P_c: Poisson's restitution, out of which no energy can come. What is
round about the contact has k_tn = 0: there this is Newton's.
"""

from __future__ import annotations

from math import copysign, inf
from typing import NamedTuple

from exudyn_flexlink.raising import Sendable

ROUND = 1e-9  # of sqrt(k_t k_n): less of k_tn is rounding, and so is less of k_n in what it opens


class Meeting(NamedTuple):
    """Inverse masses k_t, k_n, k_tn (1/kg), slip u_a and rate w_a of the gap before (m/s).

    `contact` is its name.
    """

    along: float
    across: float
    both: float
    slip: float
    rate: float
    contact: str = ""

    @property
    def is_round(self) -> bool:
        """Tell whether neither impulse changes the speed that the other does."""
        return self.both**2 <= ROUND**2 * self.along * self.across


class JammedError(Sendable, ArithmeticError):
    """Friction presses a contact together by more than its force opens it: it has no answer."""

    advice = "a smaller 'friction', or a law with stiffness"

    def __init__(self, contact: str) -> None:
        """Take the name of the contact."""
        why = "its force would press the bodies together by more than it parts them"
        super().__init__(f"friction jams the contact '{contact}': {why}")


def impulses(at: Meeting, friction: float, restitution: float) -> tuple[float, float]:
    """Return P_n and P_t (N s) of an impact with a coefficient of friction and a restitution.

    Raises:
        JammedError: no impulse, however large, ends the approach.

    """
    both = 0.0 if at.is_round else at.both
    slides, then = _ways(at, both, friction)
    turning = both + at.along * slides
    stops = -at.slip / turning if at.slip * turning < 0 else 0.0 if at.slip == 0 else inf
    closing = at.across + both * slides
    squeezed = -at.rate / closing if closing > ROUND * at.across else inf
    if squeezed > stops:
        left, closing = at.rate + closing * stops, at.across + both * then
        squeezed = stops - left / closing if closing > ROUND * at.across else inf
    if squeezed == inf:
        raise JammedError(at.contact)
    pressed = (1 + restitution) * squeezed
    slid = min(pressed, stops)
    return pressed, slides * slid + then * (pressed - slid)


def _ways(at: Meeting, both: float, friction: float) -> tuple[float, float]:
    """Return dP_t/dP_n at first, and once the slip has come to zero."""
    sticks = at.along > 0 and abs(both) <= friction * at.along
    # What can't be moved along rubs without an effect; at rest it needs no force.
    then = -both / at.along if sticks else -copysign(friction, both) if both else 0.0
    return (-copysign(friction, at.slip) if at.slip else then), then


def turned_back(at: Meeting, friction: float, pressed: float, returns: float) -> float:
    """Return P_t (N s) of what is round, where the part `returns` of the slip comes back."""
    if at.along == 0:
        return 0.0
    bound = friction * pressed
    return max(-bound, min(bound, -(1 + returns) * at.slip / at.along))
