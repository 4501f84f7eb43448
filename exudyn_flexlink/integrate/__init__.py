"""Numerical methods for equations of motion ``M(q) q'' = f(t, q, q')``; no mechanics.

A problem evaluates mass matrix and force, and what a method asks for beside them; engines bring
their own. `solve` goes from step to step over stops and events, `stepper` makes implicit steps as
short as their error asks, and on events, which `events` locates; `radau` is one step, by the
method in `collocation`.
"""
