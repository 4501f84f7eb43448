"""Which engine and formulation takes which part: the table of docs/engines.md, row by row.

Each row is a change of one mechanism that all of them take: the paper's link, with a beam's hinges.
"""

import re

import numpy as np
import pytest
from pages_of_docs import DOCS, ROOT, text_of

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.engines.exudyn.redundant.run import prepare
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.scene import json_schema

PAPER = ROOT / "models" / "no_clearance.yaml"
BASE = ["bodies.link.hinges.stiffness=beam", "bodies.link.rods=3"]
SHORT = ["run={duration: 0.5 ms}", "accuracy={tolerance: 1.0e-5}"]
COLUMNS = ["minimal", "redundant", "beam", "Lagrangian"]
LAW = "law: {stiffness: 1.0e5, restitution: 0.5}"
SETLAW = "law={stiffness: 1.0e5, restitution: 0.5}"
ARM = "bodies.arm={type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], e: [0.1, 0]}}"
HUB = "joints.hub={type: revolute, points: [ground, arm.o], at: [1, 0]}"
PULL = "springs.s={type: linear, points: [arm.e, ground], at: [1.2, 0], "
BOUNCE = "{stiffness: 1.0e5, restitution: 0.5}"
SLIDE = "joints.way={type: prismatic, points: [ground, other.o], at: [2, 0], axis: [1, 0]"
WAY = f"{SLIDE}, limits: {{from: -0.1, to: 0.1"
OTHER = "bodies.other={type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], e: [0.1, 0]}}"
PINNED = [ARM, HUB]
PAIR = [*PINNED, OTHER]
RACK = "joints.rack={type: gear, joints: [hub, way], radius: 0.1}"
FREE = "initial={positions: {other: [2, 0]}}"

CHANGES = {
    "`rod`, `rigid` on a pin of the ground": PINNED,
    "`rigid` without a joint": [OTHER, FREE],
    "`rigid` with `inertia: 0`": [OTHER, "bodies.other.inertia=0", FREE],
    "`flexible`: the link in its sleeve": [],
    "`flexible`: any other": [
        *PINNED,
        "bodies.strip={type: flexible, length: 0.1, material: steel, rods: 2, "
        "section: {type: round, diameter: 1 mm}, hinges: {stiffness: beam}}",
        "joints.clamp={type: weld, points: [arm.e, strip.start]}",
    ],
    "`flexible` with `stretch`": ["bodies.link.stretch=true"],
    "`flexible` with hinges `paper`": ["bodies.link.hinges.stiffness=paper"],
    "`ellipse`, `joined`, `laps`": [],
    "`polygon`, and `joined` with `round`": [
        "curves.edge={type: joined, round: 5 mm, pieces: [{type: line, from: [0.04, -0.02], "
        "to: [0.04, 0.02]}, {type: line, from: [0.04, 0.02], to: [0.02, 0.04]}, corner]}",
        "curves.corner={type: polygon, points: [[0.02, 0.04], [-0.02, 0.04], [-0.04, 0.02]], "
        "round: 5 mm}",
        "joints.pin.curve=edge",
    ],
    "`circle`": [
        "curves.ring={type: circle, centre: [0, 0], radius: 0.04}",
        "joints.pin.curve=ring",
    ],
    "`superellipse`": [
        "curves.pad={type: superellipse, centre: [0, 0], semi_axes: [0.04, 0.03], exponent: 4}",
        "joints.pin.curve=pad",
    ],
    "`line`": [
        "curves.edge={type: line, from: [0.04, -0.04], to: [0.04, 0.04]}",
        "joints.pin.curve=edge",
    ],
    "`spline`": [
        "curves.bent={type: spline, points: [[0.04, 0], [0, 0.03], [-0.04, 0], [0, -0.03]]}",
        "joints.pin.curve=bent",
    ],
    "a curve that is `on` a body": [
        *PINNED,
        "curves.groove={type: circle, centre: [-1, 0], radius: 0.04, on: arm}",
        "joints.pin.curve=groove",
    ],
    "`revolute` between moving bodies": [
        *PAIR,
        "joints.elbow={type: revolute, points: [arm.e, other.o]}",
        "initial={angles: {other: 0}}",
    ],
    "`revolute` with `clearance`": [*PINNED, "joints.hub.clearance=1 mm", f"joints.hub.{SETLAW}"],
    "`revolute` with `friction: {torque}`": [*PINNED, "joints.hub.friction={torque: 0.1}"],
    "`revolute` with `friction: {coefficient}`": [
        *PINNED,
        "joints.hub.friction={coefficient: 0.1, radius: 5 mm}",
    ],
    "`revolute` with `freewheel`": [*PINNED, "joints.hub.freewheel=forward"],
    "`weld`": [*PAIR, "joints.glue={type: weld, points: [arm.e, other.o]}"],
    "`prismatic`": [OTHER, f"{SLIDE}}}"],
    "`limits` of a `prismatic`, with `restitution`": [OTHER, f"{WAY}, law: {BOUNCE}}}}}"],
    "`limits` of a `prismatic`, law `hertz`": [
        OTHER,
        f"{WAY}, law: {{type: hertz, stiffness: 1.0e7}}}}}}",
    ],
    "`limits` of a `prismatic`, with `damping`": [
        OTHER,
        f"{WAY}, law: {{stiffness: 1.0e5, damping: 1}}}}}}",
    ],
    "`limits` of a `revolute`": [
        *PINNED,
        "joints.hub.limits={to: 1, law: {stiffness: 1.0e5, restitution: 0.5}}",
    ],
    "`prismatic` with `friction: {force}`": [OTHER, f"{SLIDE}, friction: {{force: 1}}}}"],
    "`gear` of two hinges, `belt`": [
        *PAIR,
        "joints.axle={type: revolute, points: [ground, other.o], at: [2, 0]}",
        "joints.mesh={type: gear, joints: [hub, axle], teeth: [20, 40]}",
        "joints.strap={type: belt, joints: [crank, hub], radii: [0.1, 0.2]}",
    ],
    "`gear` with `backlash`": [
        *PAIR,
        "joints.axle={type: revolute, points: [ground, other.o], at: [2, 0]}",
        "joints.mesh={type: gear, joints: [hub, axle], ratio: 2, backlash: 0.01}",
        "joints.mesh.law={type: impulse, restitution: 0.5}",
    ],
    "`gear` with a rack": [*PAIR, f"{SLIDE}}}", RACK],
    "`gear` with a rack on a moving body": [
        *PAIR,
        "bodies.rack={type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0]}}",
        "joints.axle={type: revolute, points: [arm.e, other.o]}",
        "joints.way={type: prismatic, points: [arm.o, rack.o], axis: [1, 0]}",
        "joints.rack={type: gear, joints: [axle, way], radius: 0.1}",
    ],
    "`sleeve` without clearance": [],
    "`sleeve` with `clearance`": ["joints.sleeve.clearance=0.1 mm", f"joints.sleeve.{SETLAW}"],
    "`sleeve` with `supported`": ["joints.sleeve.supported=true", f"joints.sleeve.{SETLAW}"],
    "`slot` of the link's start": [],
    "`slot` of another point": [
        OTHER,
        "curves.edge={type: line, from: [1, 0], to: [3, 0]}",
        "joints.bead={type: slot, point: other.e, curve: edge}",
        FREE,
    ],
    "`slot` with `clearance`": ["joints.pin.clearance=0.2 mm", f"joints.pin.{SETLAW}"],
    "`torsional`": [],
    "`linear`": [*PINNED, f"{PULL}stiffness: 100}}"],
    "`linear` with `acts`": [*PINNED, f"{PULL}stiffness: 100, acts: tension, length: 0.2}}"],
    "`rope` over points": [
        *PINNED,
        "springs.s={type: rope, over: [arm.e, [1.2, 0], [1.3, 0.1]], stiffness: 100, length: 0.3}",
    ],
    "`linear` with `force`": [*PINNED, f"{PULL}force: 100*length**2}}"],
    "`torsional` with `torque`": [
        *PINNED,
        "springs.s={type: torsional, joint: hub, torque: {points: [[-1, -9], [0, 0], [1, 5]]}}",
    ],
    "`speed` of the guide": [],
    "`speed` of another joint": [*PINNED, "drives.other={type: speed, joint: hub, value: 1}"],
    "`motion`": ["drives.motor={type: motion, joint: crank, value: 10*t}"],
    "`torque`": ["drives.motor={type: torque, joint: crank, value: 0.1}"],
    "`force`": ["drives.push={type: force, point: link.end, value: [1, 0]}"],
    "an expression": ["drives.motor.value=10*cos(t)"],
    "a table": ["drives.motor.value={points: [[0, 10], [1, 11], [2, 9], [3, 10]], rule: cubic}"],
    "`point_on_line`: the link's end strikes a lever": [],
    "`point_on_line`: any other": [
        *PINNED,
        "contacts.hit={type: point_on_line, point: arm.e, line: [lever.start, lever.end], "
        f"{LAW}}}",
    ],
    "`circle_on_circle`": [
        "contacts.hit={type: circle_on_circle, circles: [{at: link.end, radius: 1 mm}, "
        f"{{at: lever.end, radius: 1 mm}}], {LAW}}}",
    ],
    "`point_on_curve`": [
        "curves.floor={type: line, from: [-1, -1], to: [1, -1]}",
        f"contacts.hit={{type: point_on_curve, point: link.end, curve: floor, {LAW}}}",
    ],
    "`line_on_curve`": [
        *PINNED,
        "curves.floor={type: circle, centre: [1, -1], radius: 0.5}",
        "contacts.hit={type: line_on_curve, line: [arm.o, arm.e], side: right, curve: floor, "
        f"{LAW}}}",
    ],
    "law `penalty`, `friction`": ["contacts.strike.law.friction=0.1"],
    "law `hertz`": ["contacts.strike.law={type: hertz, stiffness: 1.0e7}"],
    "law `hertz`, `johnson` or `radzimovsky`": [
        "materials.steel.poissons_ratio=0.3",
        "contacts.strike.law={type: hertz, materials: [steel, steel], formula: johnson, "
        "radii: [1 mm, 2 mm], length: 5 mm}",
    ],
    "laws `hunt_crossley`, `lankarani_nikravesh`, `flores`, `gonthier`, `exact`": [
        "contacts.strike.law={type: flores, stiffness: 1.0e7, restitution: 0.5}"
    ],
    "law `impulse`": ["contacts.strike.law={type: impulse, restitution: 0.5}"],
    "law `impulse`, `friction`": [
        "contacts.strike.law={type: impulse, restitution: 0.5, friction: 0.1}"
    ],
    "`gravity`": ["gravity=[1, -9.81]"],
    "`until`": ["run.until=t - 1"],
    "`stages`": ["run={duration: 5 ms}", "stages=[{until: t - 1}]"],
}


def table():
    """Rows of the page's table: what each column says of a part."""
    text = text_of(DOCS / "engines.md").split("## Which part runs where")[1].split("\n## ")[0]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.splitlines()
        if line.startswith("| ") and not line.startswith("| |")
    ]
    return {row[0]: row[1:] for row in rows}


def taken(label, column):
    """Return "yes", "creeps", or "no": the changed part is refused by name."""
    changes = [*BASE, *SHORT, *CHANGES[label]]
    lagrangian = column == "Lagrangian"
    if not lagrangian:
        changes.append(f"solver.formulation={column}")
    scene = load_scene(PAPER, changes)
    try:
        result = simulate(scene, "lagrangian" if lagrangian else "exudyn", measure=False)
    except NotRepresentableError as error:
        changed = {tuple(change.split("=")[0].split(".")[:2]) for change in CHANGES[label]}
        named = any(error.path[: len(path)] == path for path in changed)
        return "no" if named else f"no, but by {error}"
    if any("creeps" in warning for warning in result.warnings):
        return "creeps"
    return "yes" if result.outcome.completed else result.outcome.reason


def test_the_table_has_every_part_of_the_language():
    types = {
        word
        for part in json_schema()["$defs"].values()
        if (kind := part.get("properties", {}).get("type", {}))
        for word in kind.get("enum", [kind.get("const")])
    }
    named = set(re.findall(r"`(\w+)`", " ".join(table())))
    assert types - {"rectangle", "round", "general"} <= named
    assert list(table()) == list(CHANGES)


@pytest.mark.parametrize("label", CHANGES)
def test_engines_take_what_the_table_says(label):
    assert [taken(label, column) for column in COLUMNS] == table()[label]


def test_the_lagrangian_shows_the_line_of_what_it_refuses(capsys):
    model = ROOT / "models" / "textbook" / "cam_follower.yaml"
    assert main(["simulate", str(model), "--engine", "lagrangian", "--quiet"]) == 2
    shown = capsys.readouterr().err
    assert re.match(rf"{re.escape(str(model))}:\d+:\d+: \w+", shown)
    assert "hint: refused by the engine 'lagrangian'" in shown


@pytest.mark.parametrize("formulation", ["redundant", "beam"])
def test_the_gradient_of_a_curve_that_a_body_carries_has_a_column_for_each_coordinate(formulation):
    """By differences; Exudyn reads a missing column from memory that is not its own, silently."""
    changes = [*BASE, *SHORT, *CHANGES["a curve that is `on` a body"]]
    scene = load_scene(PAPER, [*changes, f"solver.formulation={formulation}"])
    (slot,) = prepare(scene, assemble_scene(scene), None, 1.0).loop.slots
    q = np.array([0.1, 0.2, 0.3, -0.83, 0.06, 0.9, 0.4, 0.0][: 6 + (formulation == "beam")])

    def distance(place):
        return slot._distance(None, 0.0, 0, place.tolist(), [], False)[0]

    steps = 1e-6 * np.eye(len(q))
    expected = [(distance(q + step) - distance(q - step)) / 2e-6 for step in steps]
    (found,) = slot._gradient(None, 0.0, 0, q.tolist(), [], False)
    assert found == pytest.approx(expected, abs=1e-8)
