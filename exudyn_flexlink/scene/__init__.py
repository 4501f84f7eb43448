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
from exudyn_flexlink.scene.contact_laws import (
    ContactLaw,
    DampedLaw,
    HertzLaw,
    ImpulseLaw,
    Law,
    PenaltyLaw,
    RubbingImpulse,
)
from exudyn_flexlink.scene.contacts import (
    CircleOnCircle,
    Contact,
    LineOnCurve,
    PointOnCurve,
    PointOnLine,
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
    Drive,
    ForceDrive,
    LinearSpring,
    MotionDrive,
    SpeedDrive,
    Spring,
    TorqueDrive,
    TorsionalSpring,
)
from exudyn_flexlink.scene.gears import BeltJoint, GearJoint, Mesh, ends_of, meshes_of
from exudyn_flexlink.scene.joints import (
    Joint,
    PinFriction,
    PointsJoint,
    PrismaticJoint,
    RevoluteJoint,
    SleeveJoint,
    SlideFriction,
    SlotJoint,
    WeldJoint,
)
from exudyn_flexlink.scene.limits import SlidePenalty, Stop, StopLaw, TurnPenalty
from exudyn_flexlink.scene.lookup import references
from exudyn_flexlink.scene.model import Scene
from exudyn_flexlink.scene.parse import (
    SECTION_OF,
    apply_settings,
    check_document,
    parse_scene,
)
from exudyn_flexlink.scene.point_masses import stays_a_point
from exudyn_flexlink.scene.run import (
    FEWEST_STEPS_PER_CONTACT,
    INITIAL_OF_JOINTS,
    Accuracy,
    Initial,
    Outputs,
    Run,
    Solver,
)
from exudyn_flexlink.scene.schema import is_schema, json_schema
from exudyn_flexlink.scene.varying import ForceLaw, ForceTable, Table, TorqueLaw, Value
