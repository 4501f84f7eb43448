"""A small scene, for processes that a test starts: nothing that takes long is imported."""

from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.source import parse_document

PENDULUM = """title: pendulum
materials:
  steel: {density: 7850, youngs_modulus: 200 GPa}
bodies:
  rod: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm}}
joints:
  pin: {type: revolute, points: [ground, rod.start], at: [0.1, 0]}
gravity: [0, -9.81]
run: {duration: 1}
accuracy: {tolerance: 1.0e-5}
"""


def scene_from(text):
    return scene_of(parse_document(text, "test"))
