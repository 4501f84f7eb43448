"""What a Result means: crank angle, path of a point, response of a struck body, strikes, touches.

Pure numbers from a `Result`: no engine, no file. Times in s, lengths in m, angles in rad; N is the
number of samples. What a scene does not have, a point, a contact, a joint with walls, or a revolute
joint where a crank is asked for, is a ValueError that says so.
"""

from exudyn_flexlink.observables.answers import (
    ANGLE,
    DISPLACEMENT,
    Measure,
    carrying_joint,
    measures,
)
from exudyn_flexlink.observables.crank import (
    crank_angle,
    crank_column,
    crank_joint,
    first_passes,
    joint_angle,
    laps,
    steady_speeds,
    turned_since_start,
    turns,
)
from exudyn_flexlink.observables.forces import (
    Force,
    force_peaks,
    forces_of,
    momentary_forces,
)
from exudyn_flexlink.observables.joints import JointForce, force_error, joint_force
from exudyn_flexlink.observables.levers import LeverResponse, lever_response, struck_bodies
from exudyn_flexlink.observables.parting import (
    STILL,
    Deviation,
    common_points,
    common_times,
    error_between,
    farthest,
    first_beyond,
    force_deviations,
    parting_limit,
    positions,
    separation,
    separations,
    touching,
    worst_force,
)
from exudyn_flexlink.observables.points import (
    BodyMotion,
    PointPath,
    between_samples,
    body_motion,
    judged_points,
    name_of,
    path,
    paths,
    point_anchor,
    point_names,
    room,
    still_text,
    straight_between,
    watched_point,
)
from exudyn_flexlink.observables.signals import (
    Signal,
    own_columns,
    signals,
    unknown_signal,
)
from exudyn_flexlink.observables.strikes import SAME_STRIKE, Strike, strikes
from exudyn_flexlink.observables.touching import (
    TWO_POINTS,
    ContactStates,
    ContactTotals,
    PairTotals,
    State,
    contact_states,
    contact_totals,
    deepest,
    joints_with_play,
    lap_contacts,
    lap_starts,
    pair_totals,
    sleeves_with_play,
)
from exudyn_flexlink.observables.vibration import (
    Vibration,
    on_axis,
    perturbation,
    spectrum,
    strongest_line,
    vibration,
)
from exudyn_flexlink.observables.watched import Watched
