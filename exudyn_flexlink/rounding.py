"""What rounding leaves of numbers that would be equal, or zero, without it.

A double is rounded to 1.1e-16 of itself. How much of that is left in a result depends on what it
has gone through. These parts of the size of what is compared are those of the whole package.
"""

UNIT_ROUNDING = 1e-15  # of a number: 4 to 9 times what it is rounded to, as by a few operations
SUM_ROUNDING = 1e-14  # of the terms: what rounding leaves of a sum of tens of them
ROUNDING = 1e-12  # of the largest: what it leaves of numbers for which equations were solved
NEGLIGIBLE = 1e-9  # of the size: decimals as they are typed, ends of searches, rates at rest

LEAST_LENGTH = 1e-15  # m: no gap and no place is known better
TINY = 1e-300  # in place of zero where something is divided by it: then nothing comes of it
PLACE_ROUNDING = 1e-12  # m or rad: what events and steps leave of a gap; foils rest 5e-12 m deep
INVISIBLE = 1e-9  # m or rad: nobody types, or sees, so little of a place
EVENT_TIME = 1e-13  # s: accuracy of an event's instant, where the clock resolves it
LAST_PLACES = 4  # units in the last place of an instant: of those so near, either may be first
KNOT_TIME = 1e-12  # s: instants so near to each other are one, as times of steps add up to that
