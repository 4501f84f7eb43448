"""The scene: every part of a model, checked, in SI units; see `Scene`."""

from exudyn_flexlink.scene.base import GROUND, FrozenMapping, Part, split_point
from exudyn_flexlink.scene.bodies import (
    Body,
    FlexibleBody,
    GeneralSection,
    Hinges,
    Material,
    RectangleSection,
    RigidBody,
    RodBody,
    RoundSection,
    Section,
)
from exudyn_flexlink.scene.curve_specs import (
    CircleSpec,
    CurveSpec,
    EllipseSpec,
    JoinedSpec,
    LapsSpec,
    LineSpec,
    SplineSpec,
)
from exudyn_flexlink.scene.forces import (
    Contact,
    Drive,
    PointOnLine,
    SpeedDrive,
    Spring,
    TorqueDrive,
    TorsionalSpring,
)
from exudyn_flexlink.scene.joints import (
    Joint,
    RevoluteJoint,
    SleeveJoint,
    SlotJoint,
    WeldJoint,
)
from exudyn_flexlink.scene.law_specs import ContactLaw, ImpulseLaw, Law
from exudyn_flexlink.scene.model import Scene
from exudyn_flexlink.scene.outputs import Outputs
from exudyn_flexlink.scene.parse import (
    EXCLUSIVE_KEYS,
    SECTION_OF,
    CheckedDocument,
    apply_settings,
    check_document,
    parse_scene,
)
from exudyn_flexlink.scene.run import (
    FEWEST_STEPS_PER_CONTACT,
    Accuracy,
    Initial,
    Run,
    Solver,
)
from exudyn_flexlink.scene.schema import is_schema, json_schema

__all__ = [
    "EXCLUSIVE_KEYS",
    "FEWEST_STEPS_PER_CONTACT",
    "GROUND",
    "SECTION_OF",
    "Accuracy",
    "Body",
    "CheckedDocument",
    "CircleSpec",
    "Contact",
    "ContactLaw",
    "CurveSpec",
    "Drive",
    "EllipseSpec",
    "FlexibleBody",
    "FrozenMapping",
    "GeneralSection",
    "Hinges",
    "ImpulseLaw",
    "Initial",
    "JoinedSpec",
    "Joint",
    "LapsSpec",
    "Law",
    "LineSpec",
    "Material",
    "Outputs",
    "Part",
    "PointOnLine",
    "RectangleSection",
    "RevoluteJoint",
    "RigidBody",
    "RodBody",
    "RoundSection",
    "Run",
    "Scene",
    "Section",
    "SleeveJoint",
    "SlotJoint",
    "Solver",
    "SpeedDrive",
    "SplineSpec",
    "Spring",
    "TorqueDrive",
    "TorsionalSpring",
    "WeldJoint",
    "apply_settings",
    "check_document",
    "is_schema",
    "json_schema",
    "parse_scene",
    "split_point",
]
