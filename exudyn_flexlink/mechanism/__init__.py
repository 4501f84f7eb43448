"""A scene as rigid parts, joints, springs, drives and contacts in numbers, and its kinematics."""

from exudyn_flexlink.mechanism.assembly import (
    Assembly,
    CannotMoveError,
    State,
    always_redundant,
    assemble,
)
from exudyn_flexlink.mechanism.bodies import beam_of, chain_of
from exudyn_flexlink.mechanism.build import build_mechanism
from exudyn_flexlink.mechanism.closing import CLOSED, CannotAssembleError, closest
from exudyn_flexlink.mechanism.constraints import joint_residuals
from exudyn_flexlink.mechanism.contact_pairs import (
    Channel,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    TurnStop,
    deepest_allowed,
    pair_sides,
    pairs,
)
from exudyn_flexlink.mechanism.contacts import (
    TOUCHING,
    approach,
    grip_of,
    idle_at_start,
    in_guides,
    pressed_among,
    pressed_at,
    swings,
)
from exudyn_flexlink.mechanism.dynamics import (
    EnergyMeter,
    accelerations,
    applied_forces,
    constraints_at,
    contact_mass,
    demanded_accelerations,
    mass_blocks,
    spring_force,
    wound_at_start,
)
from exudyn_flexlink.mechanism.equilibrium import rest_of
from exudyn_flexlink.mechanism.gears import tooth_pushes, without_teeth
from exudyn_flexlink.mechanism.input_checks import drive_mistakes, input_notes
from exudyn_flexlink.mechanism.kinematics import (
    anchor_jacobian,
    anchor_position,
    anchor_velocity,
    angle_of,
    force_at,
    joint_speed,
    left_of,
    length_along,
    line_of,
    motor_place,
    sensed,
    size_at,
    sizes_at,
    slot_point,
    speed_along,
    turned,
    turning,
)
from exudyn_flexlink.mechanism.laying_out import Start
from exudyn_flexlink.mechanism.mobility import moved_by_forces, other_branches, shared_forces
from exudyn_flexlink.mechanism.model import (
    Apart,
    Gear,
    JointFriction,
    LinearSpring,
    Mechanism,
    Motor,
    Pin,
    Placed,
    PointForce,
    RotarySpring,
    Sense,
    Size,
    Slide,
    Sliding,
    Slot,
    TorqueMotor,
    Turning,
    Weld,
)
from exudyn_flexlink.mechanism.parts import GROUND, Anchor, RigidPart
from exudyn_flexlink.mechanism.prescribed import Applied, Prescribed, Ramp
from exudyn_flexlink.mechanism.pulses import with_pulses
from exudyn_flexlink.mechanism.resting import NoRestError, Rest
from exudyn_flexlink.mechanism.schedule import (
    Resolution,
    TurnGoal,
    coarse_tolerance,
    cut_off,
    end_of_run,
    extent,
    fittest,
    formulation,
    half_period,
    half_periods,
    kept_interval,
    least_tolerance,
    resolutions,
    sample_bytes,
    sample_times,
    turn_goal,
    wanted_interval,
)
from exudyn_flexlink.mechanism.tracks import build_curves
from exudyn_flexlink.mechanism.unknown_to_exudyn import beyond_redundant
from exudyn_flexlink.mechanism.weld_groups import inertia_with_welded, welded_to
