"""Numerical methods for equations of motion ``M(q) q'' = f(t, q, q')``; no mechanics.

A `problem.Problem` evaluates mass matrix and force, and what an implicit method asks for beside
them; engines bring their own. `collocation` holds the method, `radau` its step, `contact_share`
what forces that leap do in it, `control` how long the next one is.
"""
