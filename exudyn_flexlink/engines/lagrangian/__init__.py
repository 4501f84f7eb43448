"""The paper's own method: hand-written equations of motion, and SciPy to integrate them."""

from exudyn_flexlink.engines.lagrangian.run import run, takes_tolerance

__all__ = ["run", "takes_tolerance"]
