"""Forces of many penalty contacts by gaps and rates, with their slopes: as `laws` has them.

A force goes on smoothly where a gap has opened: there a touch ends, within the step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.laws import Impulse, PressingLaw
from exudyn_flexlink.mechanism import Channel, Contact


class Laws:
    """Laws of contacts (c,); rigid ones have no force."""

    def __init__(self, laws: Sequence[PressingLaw]) -> None:
        self.exponents = np.array([getattr(law, "exponent", 1.0) for law in laws])
        giving = dict.fromkeys(law for law in laws if not isinstance(law, Impulse))
        self._members = [(law, np.array([one == law for one in laws])) for law in giving]
        self._only = next(iter(giving), None) if len(set(laws)) == 1 else None

    def pressing(
        self, which: IndexArray, gap: FloatArray, rate: FloatArray, approach: FloatArray
    ) -> Pressing:
        """Forces of some (k,) by their gaps and rates (..., k).

        `approach` (c,) are the speeds (m/s) with which the touches of all began.
        """
        if self._only is not None:
            return Pressing(*self._only.pressing(-gap, -rate, approach[which]))
        found = Pressing(*np.zeros((3, *gap.shape)))
        for law, members in self._members:
            own = members[which]
            if own.any():
                parts = law.pressing(-gap[..., own], -rate[..., own], approach[which[own]])
                for column, part in zip(found, parts, strict=True):
                    column[..., own] = part
        return found


def rubbing(contacts: Sequence[Contact | Channel]) -> FloatArray:
    """Friction of contacts (2, c): coefficients, 0 if smooth, and slip speeds (m/s)."""
    rubs = [own.friction for own in contacts]
    found = [(rub.coefficient, rub.slip_speed) if rub else (0.0, 1.0) for rub in rubs]
    return np.asarray(np.array(found).reshape(-1, 2).T, dtype=np.float64)


def press_by(laws: Sequence[PressingLaw], approach: FloatArray) -> Press:
    """Forces of contacts and their slopes, by gaps and rates (..., c, 2); none where they open.

    Their touches began with the speeds `approach` (c,), m/s. What lets go before it opens is
    followed beyond.
    """
    own, every = Laws(laws), np.arange(len(laws))
    lets_go = np.array([not isinstance(law, Impulse) and law.lets_go for law in laws], dtype=bool)

    def press(touching: FloatArray) -> Pressing:
        gap = touching[..., 0]
        found = own.pressing(every, gap, touching[..., 1], approach)
        closed = (gap < 0) | lets_go
        return found._replace(force=found.force * closed, stiffness=found.stiffness * closed)

    return press
