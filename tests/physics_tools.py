"""What the tests named after laws of nature share: inline scenes, runs, closed forms."""

import numpy as np
from cli_runs import MODELS

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.exudyn.minimal.contacts import TreeContacts
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.mechanism.tree import tree_layout
from exudyn_flexlink.observables import path
from exudyn_flexlink.source import parse_document

STEEL = "materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}\n"
SQUARE = "section: {width: 10 mm, thickness: 10 mm}"
KILOGRAM = 7850 * 1e-4 * 1.0  # kg, mass of one metre of SQUARE


# A plate that stays, and bodies before it; contacts strike the line from a to b.
FLOOR = """
  floor: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], a: [-5, 0], b: [5, 0]}}
joints:
  ground: {type: weld, points: [ground, floor.o], at: [0, 0]}
"""

# Sliders on two ways that cross, and a beam from one to the other.
TRAMMEL = """
bodies:
  a: {type: rigid, mass: 1, inertia: 1, points: {p: [0, 0]}}
  b: {type: rigid, mass: 1, inertia: 1, points: {p: [0, 0]}}
  beam: {type: rigid, mass: 2, inertia: 0.1, centre_of_mass: [0.25, 0],
         points: {s: [0, 0], e: [0.5, 0], pen: [0.7, 0.1]}}
joints:
  x: {type: prismatic, points: [ground, a.p], at: [0, 0], axis: [1, 0]}
  y: {type: prismatic, points: [ground, b.p], at: [0, 0], axis: [0, 1]}
  sa: {type: revolute, points: [a.p, beam.s]}
  sb: {type: revolute, points: [beam.e, b.p]}
accuracy: {tolerance: 1.0e-8}
"""

FALLING_ROD = """
bodies: {rod: {type: rigid, mass: 1.2, inertia: 0.064, centre_of_mass: [0.4, 0],
               points: {o: [0, 0], tip: [0.8, 0]}}}
joints: {pin: {type: revolute, points: [ground, rod.o], at: [0, 0]}}
gravity: 9.81
run: {duration: 2}
accuracy: {tolerance: 1.0e-10}
"""
PULLED_BOX = """
bodies: {box: {type: rigid, mass: 3, inertia: 1, points: {o: [0, 0]}}}
joints: {pin: {type: revolute, points: [ground, box.o], at: [0, 0]}}
drives: {pull: {type: force, point: box.o, value: ["200*t", 0]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-9}
"""


def arm_and_ball(line, start, duration):
    """An arm that turns at 3 rad/s, a ball of 2 kg that a line of it (m along the arm) strikes."""
    return f"""
bodies:
  arm: {{type: rigid, mass: 1, inertia: 0.1,
        points: {{o: [0, 0], a: [{line[0]}, 0], b: [{line[1]}, 0]}}}}
  ball: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
joints: {{pivot: {{type: revolute, points: [ground, arm.o], at: [0, 0]}}}}
drives: {{turn: {{type: speed, joint: pivot, value: 3}}}}
contacts:
  push:
    type: point_on_line
    point: ball.c
    line: [arm.a, arm.b]
    law: {{type: impulse, restitution: 0.5}}
initial: {{positions: {{ball: [1, 0]}}, speeds: {{arm: 3}}, {start}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-8}}
"""


def scene(text, *settings):
    """Scene of inline YAML."""
    return scene_of(parse_document("title: law\n" + text, "law.yaml"), settings)


def run(text, *settings):
    """Result of inline YAML, which must run to its end without a warning."""
    result = simulate(scene(text, *settings))
    assert result.outcome.completed, result.outcome
    assert result.warnings == ()
    return result


def alone(text, *settings):
    """Result of inline YAML, which may warn."""
    result = simulate(scene(text, *settings))
    assert result.outcome.completed, result.outcome
    return result


def run_model(name, *settings):
    """Result of a model file with settings."""
    result = simulate(load_scene(MODELS / name, settings))
    assert result.outcome.completed, result.outcome
    return result


def rod(length=1.0):
    """A square steel rod."""
    return f"{{type: rod, length: {length}, material: steel, {SQUARE}}}"


def where(result, point):
    """Positions (N, 2) of a point."""
    return path(result, point).position


def velocity(result, point):
    """Velocities (N, 2) of a point."""
    return path(result, point).velocity


def angle(result, part):
    """Angles (N,) of a part."""
    return result.poses[:, result.part_names.index(part), 2]


def speed(result, part):
    """Angular speeds (N,) of a part."""
    return result.rates[:, result.part_names.index(part), 2]


def total_energy(result):
    """Kinetic and stored energy (N,) in J."""
    return result.energy.kinetic + result.energy.stored


def energy_change(result):
    """Largest change (J) of energy with what was lost and supplied."""
    energy = result.energy
    total = energy.kinetic + energy.stored + energy.dissipated - energy.supplied
    return abs(total - total[0]).max()


def on_grid(result, values, interval):
    """Values at the even samples alone, without those at events."""
    number = np.round(result.time / interval)
    even = np.flatnonzero(abs(result.time / interval - number) < 1e-6)
    return values[even[np.unique(number[even], return_index=True)[1]]]


def impulses(result, name):
    """Ends of contact `name`: events with impulse and energy lost."""
    return [e for e in result.events if e.name == name and e.kind != "contact begins"]


def tree_contacts(mechanism):
    """Contacts of a mechanism, as its tree carries them."""
    layout = tree_layout(mechanism)
    return TreeContacts(layout, LinkKinematics(layout), mechanism, [])
