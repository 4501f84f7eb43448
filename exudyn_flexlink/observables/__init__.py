"""Quantities of a run: crank angle, path of a point, response of a struck body, touches, strikes.

Pure numbers from a `Result`: no engine, no file. Times in s, lengths in m, angles in rad; N is the
number of samples. If the scene lacks the point, the contact, the joint with walls, or a revolute
joint as a crank, a ValueError says so.
"""

from exudyn_flexlink.observables.bending import Bending, BendingPeak, bending
from exudyn_flexlink.observables.energies import Energies, energies
from exudyn_flexlink.observables.forces import (
    BENDING,
    Force,
    bent_links,
    force_peaks,
    forces_of,
    friction_unit,
    momentary_forces,
)
from exudyn_flexlink.observables.happenings import Happening, happenings
from exudyn_flexlink.observables.instants import (
    at_instants,
    between_samples,
    even_instants,
    require_inside,
    straight_between,
)
from exudyn_flexlink.observables.levers import (
    ANGLE,
    DISPLACEMENT,
    LeverResponse,
    Measure,
    Watched,
    carrying_joint,
    lever_response,
    measures,
    struck_bodies,
)
from exudyn_flexlink.observables.parting import (
    Deviation,
    JointForce,
    common_points,
    common_times,
    error_between,
    farthest,
    first_beyond,
    force_deviations,
    force_error,
    force_of,
    joint_force,
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
    body_motion,
    crank_angle,
    crank_column,
    crank_joint,
    first_passes,
    joint_angle,
    joint_turning,
    judged_points,
    laps,
    name_of,
    path,
    paths,
    point_anchor,
    point_names,
    room,
    samples_text,
    steady_speeds,
    still_text,
    turned_since_start,
    turns,
    watched_point,
)
from exudyn_flexlink.observables.signals import (
    Signal,
    Vibration,
    on_axis,
    perturbation,
    signals,
    spectrum,
    strongest_line,
    table_columns,
    unknown_signal,
    vibration,
)
from exudyn_flexlink.observables.touching import (
    SAME_STRIKE,
    TWO_POINTS,
    ContactStates,
    ContactTotals,
    PairTotals,
    State,
    Strike,
    contact_states,
    contact_totals,
    deepest,
    flight_gaps,
    joints_with_play,
    lap_contacts,
    lap_starts,
    pair_totals,
    sleeves_with_play,
    strikes,
)
