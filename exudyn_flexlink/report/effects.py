"""Which effects a scene asks for: what is not in it, no engine computes."""

from __future__ import annotations

from collections.abc import Sequence

from exudyn_flexlink.mechanism import Mechanism
from exudyn_flexlink.report.tables import Table
from exudyn_flexlink.report.text import number
from exudyn_flexlink.scene import ContactLaw, FlexibleBody, Law, RevoluteJoint, Scene, SleeveJoint


def effects_table(scene: Scene, mechanism: Mechanism) -> Table:
    """Return a row for each effect: whether it is simulated, and by which parts of the scene.

    Losses of impacts are told apart from damping, the viscous one of hinges and springs.
    """
    flexible = [n for n, b in scene.bodies.items() if isinstance(b, FlexibleBody) and b.rods > 1]
    # Joints that may have a clearance; laws of all that can touch, by its name.
    kinds = (SleeveJoint, RevoluteJoint)
    walled = {n: j for n, j in scene.joints.items() if isinstance(j, kinds)}
    sleeves = {n: j for n, j in walled.items() if isinstance(j, SleeveJoint)}
    laws: dict[str, Law] = {n: j.acting for n, j in walled.items() if j.acting is not None}
    laws |= {name: contact.law for name, contact in scene.contacts.items()}
    rough = [n for n, law in laws.items() if isinstance(law, ContactLaw) and law.friction > 0]
    gravity = [f"({number(scene.gravity[0])}, {number(scene.gravity[1])}) m/s^2"]
    rows = [
        _effect("flexibility", flexible),
        _effect("clearance", [n for n, j in walled.items() if j.clearance > 0]),
        _effect("support in the guide", [n for n, j in sleeves.items() if j.supported]),
        _effect("impact", list(scene.contacts)),
        _effect("friction", rough),
        _effect("damping", _damped(mechanism)),
        _effect("restitution below 1", [n for n, law in laws.items() if law.restitution < 1]),
        _effect("gravity", gravity if any(scene.gravity) else []),
    ]
    return Table("Effects", rows)


def _damped(mechanism: Mechanism) -> list[str]:
    """Springs with damping; the hinges of a link count as one, under the link's name."""
    damped = [spring.name for spring in mechanism.all_springs if spring.damping > 0]
    return list(dict.fromkeys(name.split(" hinge ")[0] for name in damped))


def _effect(name: str, causes: Sequence[str]) -> list[str]:
    return [name, "simulated", ", ".join(causes)] if causes else [name, "not in this scene", ""]
