"""Measured series: runs compared with them, and numbers of a scene fitted to them.

No engine is used here: the caller passes a function that runs a scene.
"""

from exudyn_flexlink.fitting.least_squares import (
    Fit,
    NoFitError,
    Parameter,
    Vary,
    fit,
    parameters_of,
)
from exudyn_flexlink.fitting.series import (
    Against,
    Distance,
    NoOverlapError,
    Series,
    against,
    read_series,
)
