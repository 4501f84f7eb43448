"""A scene as rigid parts, joints, springs, drives and contacts in numbers, and its kinematics."""

from exudyn_flexlink.mechanism.assembly import (
    Assembly,
    CannotAssembleError,
    CannotMoveError,
    Start,
    State,
    always_redundant,
    assemble,
)
from exudyn_flexlink.mechanism.bodies import beam_of, chain_of, station
from exudyn_flexlink.mechanism.branches import other_branches
from exudyn_flexlink.mechanism.build import build_mechanism
from exudyn_flexlink.mechanism.channels import deepest_allowed, node_anchor, pair_sides, pairs
from exudyn_flexlink.mechanism.constraints import constraint_rows, joint_residuals
from exudyn_flexlink.mechanism.contacts import Approach, approach, face_length, swing_times
from exudyn_flexlink.mechanism.dynamics import (
    accelerations,
    applied_forces,
    constraints_at,
    contact_mass,
    mass_matrix,
    mobility,
    solve_saddle,
)
from exudyn_flexlink.mechanism.energy import EnergyMeter, turning
from exudyn_flexlink.mechanism.kinematics import (
    anchor_jacobian,
    anchor_position,
    anchor_velocity,
    angle_of,
    rate_of_jacobian_times_velocity,
    slot_point,
    turned,
)
from exudyn_flexlink.mechanism.linear_springs import spring_force
from exudyn_flexlink.mechanism.model import (
    GROUND,
    Anchor,
    Channel,
    FaceContact,
    LinearSpring,
    Mechanism,
    Motor,
    Pin,
    RigidPart,
    RotarySpring,
    Slide,
    Slot,
    Weld,
)
from exudyn_flexlink.mechanism.ramps import Ramp
from exudyn_flexlink.mechanism.resolution import (
    Resolution,
    contact_step,
    half_period,
    resolution_of_strike,
    resolution_of_wall,
    resolutions,
    wall_half_period,
)
from exudyn_flexlink.mechanism.rounding import extent, least_tolerance
from exudyn_flexlink.mechanism.sampling import (
    kept_interval,
    sample_bytes,
    sample_times,
    wanted_interval,
)
from exudyn_flexlink.mechanism.schedule import (
    TurnGoal,
    cut_short,
    end_of_run,
    formulation,
    turn_goal,
)
from exudyn_flexlink.mechanism.tracks import build_curves

__all__ = [
    "GROUND",
    "Anchor",
    "Approach",
    "Assembly",
    "CannotAssembleError",
    "CannotMoveError",
    "Channel",
    "EnergyMeter",
    "FaceContact",
    "LinearSpring",
    "Mechanism",
    "Motor",
    "Pin",
    "Ramp",
    "Resolution",
    "RigidPart",
    "RotarySpring",
    "Slide",
    "Slot",
    "Start",
    "State",
    "TurnGoal",
    "Weld",
    "accelerations",
    "always_redundant",
    "anchor_jacobian",
    "anchor_position",
    "anchor_velocity",
    "angle_of",
    "applied_forces",
    "approach",
    "assemble",
    "beam_of",
    "build_curves",
    "build_mechanism",
    "chain_of",
    "constraint_rows",
    "constraints_at",
    "contact_mass",
    "contact_step",
    "cut_short",
    "deepest_allowed",
    "end_of_run",
    "extent",
    "face_length",
    "formulation",
    "half_period",
    "joint_residuals",
    "kept_interval",
    "least_tolerance",
    "mass_matrix",
    "mobility",
    "node_anchor",
    "other_branches",
    "pair_sides",
    "pairs",
    "rate_of_jacobian_times_velocity",
    "resolution_of_strike",
    "resolution_of_wall",
    "resolutions",
    "sample_bytes",
    "sample_times",
    "slot_point",
    "solve_saddle",
    "spring_force",
    "station",
    "swing_times",
    "turn_goal",
    "turned",
    "turning",
    "wall_half_period",
    "wanted_interval",
]
