"""Measured series: runs held against them, and numbers of a scene fitted to them.

No engine here: whoever fits hands in what runs a scene.
"""

from exudyn_flexlink.fitting.against import Against, Distance, NoOverlapError, against
from exudyn_flexlink.fitting.least_squares import Fit, NoFitError, fit
from exudyn_flexlink.fitting.parameters import Parameter, Vary
from exudyn_flexlink.fitting.series import Series, read_series
