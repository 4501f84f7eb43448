"""Differences by rounding between numbers that would be equal, or zero, without it.

A double has a relative rounding error of 1.1e-16. The error of a result depends on its operations.
The whole package uses these limits; relative ones are parts of the size of the compared numbers.
"""

UNIT_ROUNDING = 1e-15  # of a number: 4 to 9 times its rounding, after a few operations
SUM_ROUNDING = 1e-14  # of the terms: rounding in a sum of tens of them
ROUNDING = 1e-12  # of the largest: rounding in solutions of equations
SOLVED = 1e-10  # of the largest: forces and mobilities that contacts or joints share, of their W
NEGLIGIBLE = 1e-9  # of the size: typed decimals, ends of searches, rates at rest

LEAST_LENGTH = 1e-15  # m: best accuracy of any gap or place
TINY = 1e-300  # replaces a zero divisor; the quotient does not count
PLACE_ROUNDING = 1e-12  # m or rad: gap left by events and steps; foils rest 5e-12 m deep
NO_ENERGY = 1e-12  # J: smaller energies are rounding
INVISIBLE = 1e-9  # m or rad: nobody types or sees a smaller difference of places
EVENT_TIME = 1e-13  # s: accuracy of an event's instant, if the clock resolves it
LAST_PLACES = 4  # units in the last place: the order of nearer instants is unknown
KNOT_TIME = 1e-12  # s: nearer instants are equal; sums of steps have such errors
