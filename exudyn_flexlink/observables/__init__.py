"""What a Result means: crank angle, path of a point, response of a struck body, strikes.

Pure numbers from a `Result`: no engine, no file. Times in s, lengths in m, angles in rad; N is the
number of samples.
"""

from exudyn_flexlink.observables.crank import crank_angle, crank_joint, joint_angle, laps, turns
from exudyn_flexlink.observables.deviations import Deviation, deviation
from exudyn_flexlink.observables.energy import relative_energy_residual
from exudyn_flexlink.observables.interpolation import between_samples
from exudyn_flexlink.observables.levers import LeverResponse, lever_response, struck_bodies
from exudyn_flexlink.observables.points import PointPath, path, point_anchor, watched_point
from exudyn_flexlink.observables.strikes import IMPACT, SAME_STRIKE, Strike, settled, strikes
from exudyn_flexlink.observables.touching import (
    ContactStates,
    LapContacts,
    State,
    contact_states,
    lap_contacts,
    sleeves_with_play,
)

__all__ = [
    "IMPACT",
    "SAME_STRIKE",
    "ContactStates",
    "Deviation",
    "LapContacts",
    "LeverResponse",
    "PointPath",
    "State",
    "Strike",
    "between_samples",
    "contact_states",
    "crank_angle",
    "crank_joint",
    "deviation",
    "joint_angle",
    "lap_contacts",
    "laps",
    "lever_response",
    "path",
    "point_anchor",
    "relative_energy_residual",
    "settled",
    "sleeves_with_play",
    "strikes",
    "struck_bodies",
    "turns",
    "watched_point",
]
