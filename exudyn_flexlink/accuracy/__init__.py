"""What accuracy costs: a work-precision study of one scene, by every method that represents it.

No engine here: whoever starts a study hands in what solves a scene.
"""

from exudyn_flexlink.accuracy.advice import Advice, advise, dominating, needed, rods_needed
from exudyn_flexlink.accuracy.errors import Errors, errors
from exudyn_flexlink.accuracy.judging import NothingRunError, Point, Source, Study, judge
from exudyn_flexlink.accuracy.methods import Method, methods_of
from exudyn_flexlink.accuracy.runs import RefusedError, Runs, Solved
from exudyn_flexlink.accuracy.sources import STIFFER, beams, flexible, stiffnesses
from exudyn_flexlink.accuracy.study import study
