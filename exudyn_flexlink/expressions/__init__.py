"""Formulas of a model file: of time, and of angles, speeds and places."""

from exudyn_flexlink.expressions.expression import (
    OF_JOINTS,
    RATE,
    Expression,
    ExpressionError,
    NoValueError,
    Sensed,
    in_words,
    looks_like_expression,
    parse_expression,
    tokens_of,
)
from exudyn_flexlink.expressions.resolving import (
    RATES,
    SHORTER,
    Addend,
    Bounds,
    pole,
    pulses,
    remainders,
    resolved,
)
