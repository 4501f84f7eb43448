"""Measured series: runs held against them, and numbers of a scene fitted to them.

No engine here: whoever fits hands in what runs a scene.
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
