"""What of a scene Exudyn's own solver does not know: it steps redundant coordinates, and beams."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.scene import (
    HertzLaw,
    ImpulseLaw,
    LineOnCurve,
    PinFriction,
    PointOnCurve,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SlideFriction,
    TorsionalSpring,
)
from exudyn_flexlink.source import Mistake

NO_JUMPS = (
    "redundant coordinates need a penalty law; speeds that jump are for the formulation 'minimal' "
    "and for the engine 'lagrangian'"
)


def rubbing_joints(scene: Scene) -> Iterator[tuple[str, PinFriction | SlideFriction]]:
    """Joints with dry friction, by name."""
    for name, joint in scene.joints.items():
        friction = joint.friction if isinstance(joint, (RevoluteJoint, PrismaticJoint)) else None
        if friction is not None and friction.acts:
            yield name, friction


def beyond_redundant(scene: Scene) -> list[Mistake]:
    """Return what Exudyn's own solver does not know: contacts at curves, and where speeds jump.

    Nor formulas of cylinders, stops of hinges or with a damper, ropes, springs by tables, and
    friction by the force in a joint. It steps redundant coordinates, with beams or without.
    """
    rubbing = "friction by the force in a joint is for 'formulation: minimal'; or give a {}"
    found = [
        Mistake(
            ("joints", name, "friction", "coefficient"),
            rubbing.format("'torque'" if isinstance(own, PinFriction) else "'force'"),
        )
        for name, own in rubbing_joints(scene)
        if own.coefficient > 0
    ]
    found += _laws_beyond_redundant(scene)
    message = "a beam bends otherwise than the rods whose rest is known: take 'redundant'"
    bent = scene.initial.at_rest and scene.solver.formulation == "beam"
    found += [Mistake(("initial", "at_rest"), message)] * bent
    for name, contact in scene.contacts.items():
        if isinstance(contact, (PointOnCurve, LineOnCurve)):
            message = "Exudyn's own solver has no contacts on curves: take 'formulation: minimal'"
            found.append(Mistake(("contacts", name), message))
    for name, spring in scene.springs.items():
        key = "torque" if isinstance(spring, TorsionalSpring) else "force"
        if getattr(spring, key) is not None and name not in scene.ropes:
            message = "Exudyn's own solver has linear springs alone: take 'formulation: minimal'"
            found.append(Mistake(("springs", name, key), message))
    for name in scene.ropes:
        message = "Exudyn's own solver has no springs of one side: take 'formulation: minimal'"
        found.append(Mistake(("springs", name, "acts"), message))
    for stop in scene.stops.values():
        if stop.turns or getattr(stop.law, "restitution", None) is None:
            what = "of hinges" if stop.turns else "with a damper"
            message = f"Exudyn's own solver has no stops {what}: take 'formulation: minimal'"
            found.append(Mistake(stop.path, message))
    return found


def _laws_beyond_redundant(scene: Scene) -> Iterator[Mistake]:
    """Laws of contacts and stops that Exudyn's own solver does not know."""
    laws = {scene.law_path(name): law for name, law in scene.laws.items()}
    for path, law in laws.items():
        if isinstance(law, ImpulseLaw):
            yield Mistake(path, NO_JUMPS)
        elif isinstance(law, HertzLaw) and law.length is not None:
            message = (
                f"Exudyn's own solver has no formula '{law.formula}': take 'formulation: minimal', "
                "or 'formula: sphere'"
            )
            yield Mistake((*path, "formula"), message)
