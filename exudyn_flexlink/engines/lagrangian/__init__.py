"""The paper's own method: hand-written equations of motion, and SciPy to integrate them."""

from exudyn_flexlink.engines.lagrangian.run import run

__all__ = ["run"]
