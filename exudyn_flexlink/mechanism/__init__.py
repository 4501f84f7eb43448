"""A scene as rigid parts, joints, springs, drives and contacts in numbers, and its kinematics."""

from exudyn_flexlink.mechanism.assembly import (
    Assembly,
    CannotAssembleError,
    CannotMoveError,
    Start,
    State,
    assemble,
)
from exudyn_flexlink.mechanism.build import beam_of, build_mechanism, chain_of
from exudyn_flexlink.mechanism.contacts import Approach, approach, face_length
from exudyn_flexlink.mechanism.dynamics import accelerations, contact_mass
from exudyn_flexlink.mechanism.energy import EnergyMeter, turning
from exudyn_flexlink.mechanism.kinematics import (
    anchor_position,
    anchor_velocity,
    constraint_rows,
)
from exudyn_flexlink.mechanism.model import (
    GROUND,
    Anchor,
    FaceContact,
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

__all__ = [
    "GROUND",
    "Anchor",
    "Approach",
    "Assembly",
    "CannotAssembleError",
    "CannotMoveError",
    "EnergyMeter",
    "FaceContact",
    "Mechanism",
    "Motor",
    "Pin",
    "Ramp",
    "RigidPart",
    "RotarySpring",
    "Slide",
    "Slot",
    "Start",
    "State",
    "Weld",
    "accelerations",
    "anchor_position",
    "anchor_velocity",
    "approach",
    "assemble",
    "beam_of",
    "build_mechanism",
    "chain_of",
    "constraint_rows",
    "contact_mass",
    "face_length",
    "turning",
]
