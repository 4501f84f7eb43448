"""Numerical methods for equations of motion ``M(q) q'' = f(t, q, q')``; no mechanics.

Engines bring a problem. `solve` is the loop of every run: from step to step, over stops and events.
`stepper` makes implicit steps as short as their error asks (`control`), and on events, which
`events` locates; `radau` is one step, by the method in `collocation`, with forces that leap in
`contact_share`; `knots` ends steps where curves bend. `explicit` makes steps by SciPy's DOP853.
`turning` looks for extremes within steps.
"""
