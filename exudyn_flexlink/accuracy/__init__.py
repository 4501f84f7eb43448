"""What accuracy costs: a work-precision study of one scene, by every method that represents it.

No engine is used here: the caller of a study passes a function that solves a scene.
"""

from exudyn_flexlink.accuracy.judging import (
    Advice,
    Errors,
    NothingRunError,
    Point,
    Source,
    Study,
    advise,
    dominating,
    errors,
    judge,
    needed,
    rods_needed,
)
from exudyn_flexlink.accuracy.study import (
    STIFFER,
    Method,
    RefusedError,
    Runs,
    Solved,
    beams,
    flexible,
    methods_of,
    model_tolerance,
    stiffnesses,
    study,
)
