"""The scene: every part of a model, checked, in SI units; see `Scene`."""

from exudyn_flexlink.scene.base import GROUND, FrozenMapping, Part, split_point
from exudyn_flexlink.scene.bodies import (
    Body,
    CircleSpec,
    CurveSpec,
    EllipseSpec,
    FlexibleBody,
    GeneralSection,
    Hinges,
    JoinedSpec,
    LapsSpec,
    LineSpec,
    Material,
    RectangleSection,
    RigidBody,
    RodBody,
    RoundSection,
    Section,
    SplineSpec,
    SuperellipseSpec,
)
from exudyn_flexlink.scene.contacts import (
    CircleOnCircle,
    Contact,
    ContactLaw,
    DampedLaw,
    HertzLaw,
    ImpulseLaw,
    Law,
    LineOnCurve,
    PenaltyLaw,
    PointOnCurve,
    PointOnLine,
    RubbingImpulse,
    SlidePenalty,
    Stop,
    StopLaw,
    TurnPenalty,
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
from exudyn_flexlink.scene.joints import (
    BeltJoint,
    GearJoint,
    Joint,
    Mesh,
    PinFriction,
    PointsJoint,
    PrismaticJoint,
    RevoluteJoint,
    SleeveJoint,
    SlideFriction,
    SlotJoint,
    WeldJoint,
    ends_of,
    meshes_of,
)
from exudyn_flexlink.scene.model import (
    SECTION_OF,
    Scene,
    apply_settings,
    check_document,
    is_schema,
    json_schema,
    parse_scene,
)
from exudyn_flexlink.scene.names import references, stays_a_point
from exudyn_flexlink.scene.run import (
    FEWEST_STEPS_PER_CONTACT,
    INITIAL_OF_JOINTS,
    Accuracy,
    Initial,
    Outputs,
    Run,
    Solver,
)
from exudyn_flexlink.scene.varying import ForceLaw, ForceTable, Table, TorqueLaw, Value
