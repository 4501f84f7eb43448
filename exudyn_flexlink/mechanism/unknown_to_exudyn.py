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
from exudyn_flexlink.source import KeyPath, Mistake

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
    laws = {scene.law_path(name): law for name, law in scene.laws.items()}
    found += [Mistake(path, NO_JUMPS) for path, law in laws.items() if isinstance(law, ImpulseLaw)]
    if scene.initial.at_rest and scene.solver.formulation == "beam":
        message = "a beam bends otherwise than the rods whose rest is known: take 'redundant'"
        found.append(Mistake(("initial", "at_rest"), message))
    minimal = "Exudyn's own solver has {}: take 'formulation: minimal'"
    return found + [Mistake(path, minimal.format(what)) for path, what in _for_minimal(scene)]


def _for_minimal(scene: Scene) -> Iterator[tuple[KeyPath, str]]:
    """Where a scene has what minimal coordinates alone know, and what Exudyn has of it."""
    for name, law in scene.laws.items():
        if isinstance(law, HertzLaw) and law.length is not None:
            yield (*scene.law_path(name), "formula"), f"no formula '{law.formula}', but 'sphere'"
    curved = [n for n, own in scene.contacts.items() if isinstance(own, PointOnCurve | LineOnCurve)]
    yield from ((("contacts", name), "no contacts on curves") for name in curved)
    for name, spring in scene.springs.items():
        key = "torque" if isinstance(spring, TorsionalSpring) else "force"
        if name in scene.ropes:
            yield ("springs", name, "acts"), "no springs of one side"
        elif getattr(spring, key) is not None:
            yield ("springs", name, key), "linear springs alone"
    for stop in scene.stops.values():
        if stop.turns or getattr(stop.law, "restitution", None) is None:
            yield stop.path, f"no stops {'of hinges' if stop.turns else 'with a damper'}"
