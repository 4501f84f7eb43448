"""Formulas of a model file: of time, and of angles, speeds and places."""

from exudyn_flexlink.expressions.expression import Expression, NoValueError
from exudyn_flexlink.expressions.parsing import in_words, looks_like_expression, parse_expression
from exudyn_flexlink.expressions.ranges import Addend, Bounds
from exudyn_flexlink.expressions.resolving import SHORTER, pole, pulses, remainders, resolved
from exudyn_flexlink.expressions.tape import RATES
from exudyn_flexlink.expressions.tokens import ExpressionError, Sensed, tokens_of
