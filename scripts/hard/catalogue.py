"""The catalogue: which models are run in which variants and ways, and what must come out."""

from __future__ import annotations

from hard import truths
from hard.case import ALL, BOTH, EXUDYN, LAGRANGIAN, PLAIN, REDUNDANT, Case, Variant, over
from hard.part_cases import PART_CASES


def _law(contact: str, key: str) -> str:
    return f"contacts.{contact}.law.{key}"


STIFFNESSES = ("1e3", "1e4", "1e5", "1e6", "1e7", "1e8", "1e9")
ALL_PROPERTIES = ("mirror", "scale", "again", "finer")

CASES = (
    Case(
        "contact_stiffness",
        "one equation",
        over(_law("hit", "stiffness"), STIFFNESSES, ("1e3", "1e9")),
        EXUDYN,
        truths.hammer,
        ALL_PROPERTIES,
    ),
    Case(
        "restitution",
        "one equation",
        over(_law("hit", "restitution"), ("0", "1"), ("0", "1")),
        EXUDYN,
        truths.hammer,
        ("mirror", "again", "finer"),
    ),
    Case(
        "bouncing",
        "one equation, energy kept",
        (
            Variant("10 bounces", ("run.duration=0.92",), quick=True),
            Variant("100 bounces", told=("may be off by more than",)),
        ),
        EXUDYN,
        truths.hammer,
    ),
    Case("two_contacts", "one equation", PLAIN, EXUDYN, truths.hammer, ALL_PROPERTIES),
    Case("resting", "one equation", PLAIN, EXUDYN, truths.hammer, ("again", "finer")),
    Case(
        "start_in_contact",
        "one equation",
        (
            *PLAIN,
            Variant(
                "penetrating",
                ("initial.angles.hammer=-1e-4",),
                refused=("starts with a penetration",),
                quick=True,
            ),
        ),
        EXUDYN,
        truths.hammer,
        ("mirror", "again"),
    ),
    Case(
        "tip",
        "a strike or none",
        (
            Variant("inside", ("joints.base.at=[0.800000001,0]",), quick=True),
            Variant("beyond", ("joints.base.at=[0.799999999,0]",), quick=True),
            Variant("exactly", (), quick=True),
        ),
        EXUDYN,
        truths.hammer,
    ),
    Case(
        "grazing",
        "one equation",
        (Variant("1 um", ("run.duration=0.7",), quick=True), Variant("1 um, 5 swings")),
        EXUDYN,
        truths.hammer,
    ),
    Case(
        "strike_stiffness",
        "other engine",
        over(_law("strike", "stiffness"), STIFFNESSES, ("1e3", "1e8")),
        ALL,
        properties=ALL_PROPERTIES,
    ),
    Case(
        "strike_restitution",
        "other engine",
        over(_law("strike", "restitution"), ("0", "1"), ("0",)),
        ALL,
    ),
    Case("undamped", "energy; other engine", PLAIN, ALL, properties=("mirror", "again", "finer")),
    Case(
        "lever_mass",
        "other engine",
        tuple(
            Variant(
                f"lever {ratio} of the link",
                (f"materials.light.density={density}",),
                quick=ratio in ("1e-4", "1e4"),
            )
            for ratio, density in (
                ("1e-4", "0.916"),
                ("1e-2", "91.6"),
                ("1", "9160"),
                ("1e2", "9.16e5"),
                ("1e4", "9.16e7"),
            )
        ),
        ALL,
    ),
    Case(
        "coasting_lever",
        "other engine",
        (
            *over("springs.lever_return.frequency", ("0.001", "0.1", "1", "10"), ("0.001",)),
            Variant("no spring", ("springs={}",)),
        ),
    ),
    Case(
        "strip",
        "other engine",
        over(
            "bodies.link.section.thickness",
            ("0.05e-3", "0.15e-3", "0.5e-3", "1.5e-3", "5e-3"),
            ("0.05e-3", "5e-3"),
        ),
        ALL,
    ),
    Case(
        "rods",
        "other engine",
        over("bodies.link.rods", ("1", "2", "10", "50", "100", "200"), ("1", "10")),
    ),
    Case(
        "speed",
        "other engine",
        (
            # steps of contacts make days of a crawl in formulation redundant
            *over("drives.motor.value", ("0.01", "0.1"), ("0.01",), ways=BOTH),
            *over("drives.motor.value", ("1", "100", "300", "500"), ("100",)),
        ),
        ALL,
    ),
    Case(
        "tolerance",
        "other engine",
        (
            *over(
                "accuracy.tolerance",
                ("1e-2", "1e-3", "1e-4", "1e-5", "1e-6", "1e-8", "1e-10", "1e-12"),
                ("1e-2", "1e-8"),
            ),
        ),
    ),
    Case(
        "fixed_step",
        "other engine",
        tuple(
            Variant(
                f"step {step} s, 1e7 N/m",
                (f"accuracy.step={step}", _law("strike", "stiffness") + "=1e7"),
                quick=step == "2e-5",
            )
            for step in ("1e-4", "2e-5", "5e-6")
        ),
        EXUDYN,
    ),
    Case("grazing_lever", "closed form of S, other engine", PLAIN, ALL, truths.rigid),
    Case("grazing_side", "closed form of S, other engine", PLAIN, ALL, truths.rigid),
    Case(
        "micron_clearance",
        "other engine",
        (
            Variant("walls 1e5 N/m", quick=True),
            Variant(
                "walls 1e5 N/m, 100 rad/s",
                ("drives.motor.value=100",),
                told=("of the clearance",),
                quick=True,
            ),
        ),
        ALL,
    ),
    Case(
        "rattling_micron",
        "statistics of the other engine",
        (
            Variant(
                "walls 1e8 N/m",
                # A tenth of the clearance, as the program advises: else touches are missed.
                ("joints.sleeve.law.stiffness=1e8", "accuracy.tolerance=1e-7"),
                quick=True,
            ),
        ),
        ALL,
    ),
    Case("foil", "other engine", PLAIN, ALL, properties=("again",)),
    Case("curvature_jump", "other engine", PLAIN, ALL, properties=("mirror", "scale")),
    Case(
        "order",
        "other engine",
        (Variant("step 2e-4", ("accuracy.step=2e-4",)),),
        (REDUNDANT,),
        properties=("order",),
    ),
    Case(
        "near_cusp",
        "closed form of S",
        (
            *PLAIN,
            *(
                Variant(
                    f"semi-axis {size}, crank at {at}",
                    (f"curves.track.semi_axes=[0.04,{size}]", f"joints.crank.at=[{at},0]"),
                    quick=at == "0.039",
                    ways=ways,
                )
                for size, at, ways in (
                    ("1e-3", "0", (LAGRANGIAN,)),  # energy misses 1.4e-3 in minimal
                    ("1e-3", "0.039", BOTH),
                    ("5e-3", "0", BOTH),
                    ("5e-3", "0.039", BOTH),
                )
            ),
        ),
        ALL,
        truths.rigid,
    ),
    Case(
        "dead_centre",
        "the guide stops at 36.87 deg",
        (Variant("", refused=("guide's axis", "no solution"), quick=True),),
        ALL,
    ),
    Case(
        "slot_end",
        "the guide stops at 90 deg",
        (Variant("", refused=("reached the curve's end",), quick=True),),
        ALL,
    ),
    Case("self_crossing", "closed form of S", PLAIN, ALL, truths.rigid),
    Case(
        "spline_points",
        "closed form of S",
        (Variant("10 points", quick=True), Variant("10,000 points", points=10_000)),
        ALL,
        truths.rigid,
    ),
    Case("torque_reversal", "other engine", PLAIN, ALL, properties=("mirror",)),
    Case(
        "stall",
        "the turn is never made",
        (Variant("", refused=("'at_most' was reached",), quick=True),),
        ALL,
    ),
    Case(
        "many_turns",
        "other engine",
        (Variant("20 turns"), Variant("500 turns", ("run.turns=500",))),
    ),
    Case("paper", "other engine", (Variant("500 turns", ("run.turns=500",)),)),
    Case(
        "paper_clearance",
        "statistics of the other engine",
        (Variant("20 turns", ("run.turns=20",)),),
        (REDUNDANT,),
    ),
    *PART_CASES,
)
MODEL_OF = {
    "rattling_micron": "micron_clearance",
    "strike_restitution": "strike_stiffness",
    "order": "curvature_jump",
    "paper": "../no_clearance",
    "paper_clearance": "../clearance",
}
