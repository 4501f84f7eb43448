"""Numerical methods for equations of motion ``M(q) q'' = f(t, q, q')``; no mechanics.

Engines bring a `problem`. `solve` is the loop of every run: from step to step, over stops and
events. `stepper` makes implicit steps as short as their error asks; they end on events, which
`events` locates, and where curves bend. `radau` is one such step: the method, and contacts whose
forces leap. `explicit` makes steps by SciPy's DOP853. `complementarity` solves for impulses of
contacts.
"""
