"""Where drives jump, the integrator starts anew from the state that it has reached.

Generalised-alpha carries accelerations from step to step, beside those of the state. Carried over a
jump of a force, they would leave an error in the velocities that lasts.
"""

from __future__ import annotations

from typing import Any

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.engine import Engine


def start_anew(mbs: Any, jump: FloatArray) -> None:
    """Let the solver, between two of its steps, go on with accelerations that jump by `jump`.

    Only what initialises a run sets the accelerations that the solver keeps to itself.
    """
    data, solver = mbs.systemData, mbs.sys["dynamicSolver"]
    initial = Engine.ConfigurationType.Initial
    data.SetODE2Coordinates(data.GetODE2Coordinates(), initial)
    data.SetODE2Coordinates_t(data.GetODE2Coordinates_t(), initial)
    data.SetODE2Coordinates_tt(data.GetODE2Coordinates_tt() + jump, initial)
    time = solver.it.currentTime
    solver.InitializeSolverInitialConditions(mbs, mbs.sys["simulationSettings"])
    solver.it.currentTime = time
