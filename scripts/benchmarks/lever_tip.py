"""How far two runs are apart in the tip of the paper's lever, which no named point may be."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.comparison import Comparison


def tip_apart(compared: Comparison) -> float:
    """Largest distance (m) of the tip of the body 'lever', by its angle; 0 if it is not struck."""
    angles = compared.answer_differences.get("lever")
    if angles is None:
        return 0.0
    length = compared.first.result.scene.bodies["lever"].length
    return float(length * np.abs(angles).max())
