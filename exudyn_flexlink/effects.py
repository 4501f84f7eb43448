"""Scenes without some effects, or with other impacts: a scene in, a checked scene out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from exudyn_flexlink import scene as specs
from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Mistake, SceneError

IMPACTS = ("penalty", "impulse")


def idealise(scene: Scene, without: Iterable[str]) -> Scene:
    """Return the scene without some of its effects; what it does not have stays away.

    - ``clearance``: sleeves, revolute joints and slots are ideal: the link slides on its guide's
      axis, the journal stays in the middle of its bearing, the pin on its curve, and gears have no
      backlash.
    - ``flexibility``: flexible bodies are rigid rods of the same length, mass and section.
    - ``impact``: contacts and limits of joints go, and the bodies that are there only to be struck,
      with their joints, springs and initial values. Walls, bearings and flanks of gears stay: they
      go with the clearance.
    - ``friction``: contacts, walls, bearings and joints are smooth.
    - ``damping``: hinges and springs lose nothing, those by a formula have 0 for its ``rate``;
      contacts and walls keep their restitution, as part of the impact.

    Raises:
        ValueError: there is no such effect.

    """
    wanted = set(without)
    unknown = sorted(wanted - set(EFFECTS))
    if unknown:
        raise ValueError(f"no effect '{unknown[0]}'; there is: {', '.join(EFFECTS)}")
    for name, remove in EFFECTS.items():
        if name in wanted:
            scene = scene.changed(**remove(scene))
    return scene


def absent(scene: Scene, effects: Iterable[str]) -> list[str]:
    """Return those of some effects that the scene does not have.

    Raises:
        ValueError: there is no such effect.

    """
    return [name for name in effects if idealise(scene, [name]) == scene]


def _changed(parts: Mapping[str, Any], change: Callable[[Any], Any]) -> dict[str, Any]:
    return {name: change(part) for name, part in parts.items()}


def _in_all_stages(scene: Scene, changes: Mapping[str, Callable[[Any], Any]]) -> dict[str, Any]:
    """Change every part of some sections, also those that stages add."""
    made = {key: _changed(getattr(scene, key), change) for key, change in changes.items()}
    later = {key: change for key, change in changes.items() if key in specs.CHANGING}
    stages = [
        _with_added(stage, {key: _changed(getattr(stage.add, key), later[key]) for key in later})
        for stage in scene.stages
    ]
    return {**made, "stages": tuple(stages)}


def _with_added(stage: specs.Stage, sections: Mapping[str, Mapping[str, Any]]) -> specs.Stage:
    frozen = {key: specs.FrozenMapping(parts) for key, parts in sections.items()}
    return stage.model_copy(update={"add": stage.add.model_copy(update=frozen)})


def _ideal(joint: specs.Joint) -> specs.Joint:
    if isinstance(joint, specs.GearJoint) and joint.backlash > 0:
        return joint.model_copy(update={"backlash": 0.0, "start": 0.0, "law": None})
    played = (specs.SleeveJoint, specs.RevoluteJoint, specs.SlotJoint)
    if not isinstance(joint, played) or joint.clearance == 0:
        return joint
    round_part = type(joint).model_fields.get("radius")  # of a journal, or of a pin
    radius = {} if round_part is None else {"radius": round_part.default}
    return joint.model_copy(update={"clearance": 0.0, "law": None} | radius)


def _rigid(body: specs.Body) -> specs.Body:
    """Return a rod for a flexible body, with the fields that both have."""
    if not isinstance(body, specs.FlexibleBody):
        return body
    given = {key: getattr(body, key) for key in specs.RodBody.model_fields if key != "type"}
    return specs.RodBody(**given)


def _smooth(part: Any) -> Any:
    """Return a joint or a contact without its friction, or that of its law."""
    if getattr(part, "friction", None) is not None:
        return part.model_copy(update={"friction": None})
    law = getattr(part, "acting", getattr(part, "law", None))
    if not isinstance(law, (specs.PenaltyLaw, specs.RubbingImpulse)):
        return part
    smooth = {"friction": 0.0}
    if isinstance(law, specs.RubbingImpulse):
        smooth["tangential_restitution"] = 0.0
    return part.model_copy(update={"law": law.model_copy(update=smooth)})


def _undamped(body: specs.Body) -> specs.Body:
    if not isinstance(body, specs.FlexibleBody):
        return body
    hinges = body.hinges.model_copy(update={"damping": 0.0})
    return body.model_copy(update={"hinges": hinges})


def _lossless(spring: specs.Spring) -> specs.Spring:
    if isinstance(spring, specs.RopeSpring):
        return spring.model_copy(update={"damping": 0.0}) if spring.damping else spring
    key = "force" if isinstance(spring, specs.LinearSpring) else "torque"
    law = getattr(spring, key)
    if isinstance(law, Expression):
        spring = spring.model_copy(update={key: specs.without_rate(law)})
    if isinstance(spring, specs.LinearSpring):
        return spring.model_copy(update={"damping": 0.0}) if spring.damping else spring
    if not spring.damping and not spring.damping_ratio:
        return spring
    damper = spring.stiffness is None and spring.frequency is None and spring.torque is None
    stiffness = 0.0 if damper else spring.stiffness
    update = {"stiffness": stiffness, "damping": None, "damping_ratio": None}
    return spring.model_copy(update=update)


def _without_impact(scene: Scene) -> dict[str, Any]:
    """Remove contacts, bodies that exist only to be struck, and the joints and springs of these."""
    gone = _only_struck(scene)
    bodies = {name: body for name, body in scene.bodies.items() if name not in gone}
    kept = {n: j for n, j in scene.joints.items() if not gone & set(j.bodies)}
    joints = {n: _limited(j, None) for n, j in kept.items()}
    springs = {n: s for n, s in scene.springs.items() if _holds(s, joints, gone)}
    left: dict[str, Mapping[str, Any]] = {
        "joints": joints,
        "springs": springs,
        "drives": scene.drives,
    }
    return {
        "contacts": {},
        "curves": {name: curve for name, curve in scene.curves.items() if curve.on not in gone},
        "bodies": bodies,
        "joints": joints,
        "springs": springs,
        "initial": _initial_of(scene.initial, bodies, joints),
        "stages": tuple(_stages_without_impact(scene.stages, left)),
    }


def _stages_without_impact(
    stages: Iterable[specs.Stage], left: Mapping[str, Mapping[str, Any]]
) -> Iterator[specs.Stage]:
    """Stages without added contacts or limits that change only parts `left`, by section."""
    known = {f"{section}.{name}" for section, parts in left.items() for name in parts}
    for stage in stages:
        joints = _changed(stage.add.joints, lambda joint: _limited(joint, None))
        made = _with_added(stage, {"joints": joints, "contacts": {}})
        known |= {f"{key}.{n}" for key in specs.CHANGING for n in getattr(made.add, key)}
        removed = tuple(name for name in stage.remove if name in known)
        values = {
            key: value
            for key, value in stage.set.items()
            if ".".join(key.split(".")[:2]) in known | {"gravity"}
            and key.split(".")[2:3] != ["limits"]
        }
        update = {"remove": removed, "set": specs.FrozenMapping(values)}
        yield made.model_copy(update=update)


def _initial_of(
    initial: specs.Initial, bodies: Mapping[str, specs.Body], joints: Mapping[str, specs.Joint]
) -> specs.Initial:
    """Keep the initial values of remaining parts; a body and a joint may have the same name."""
    kept: dict[str, Any] = dict(initial)
    for key, value in initial:
        if isinstance(value, Mapping):
            named = joints if key in specs.INITIAL_OF_JOINTS else bodies
            kept[key] = {name: given for name, given in value.items() if name in named}
    return specs.Initial.model_validate(kept)


def _holds(spring: specs.Spring, joints: Mapping[str, Any], gone: set[str]) -> bool:
    """Tell whether the joints and bodies of a spring remain."""
    if isinstance(spring, specs.LinearSpring) and spring.points is not None:
        return not gone & {specs.split_point(text)[0] for text in spring.points}
    if isinstance(spring, specs.RopeSpring):
        points = (entry for entry in spring.over if isinstance(entry, str))
        return not gone & {specs.split_point(text)[0] for text in points}
    return spring.joint in joints


def _only_struck(scene: Scene) -> set[str]:
    """Bodies that exist only to be struck: only the ground holds them, and nothing else needs them.

    The striking body stays. If no body would be left, all stay.
    """
    struck = {contact.struck for contact in scene.contacts.values()}
    gone = {body for body in struck if body and _hangs_on_the_ground_alone(scene, body)}
    return gone if len(gone) < len(scene.bodies) else set()


def _hangs_on_the_ground_alone(scene: Scene, body: str) -> bool:
    """Tell whether nothing else needs a body.

    It has no joint, slot or spring to another body, no drive, does not end the run, and is not
    watched.
    """
    mine = {name for name, joint in scene.joints.items() if body in joint.bodies}
    slots = {joint.curve for joint in scene.joints.values() if isinstance(joint, specs.SlotJoint)}
    for reference in specs.references(scene):
        meant = (
            reference.text in mine
            if reference.refers.section == "joints"
            else reference.body == body
        )
        section, name = reference.path[:2]
        if not meant or section in ("contacts", "initial"):
            continue
        part = getattr(scene, section)[name] if section in ("joints", "springs") else None
        ends = {specs.split_point(text)[0] for text in getattr(part, "points", None) or ()}
        grounded = specs.PointsJoint | specs.LinearSpring | specs.TorsionalSpring
        alone = isinstance(part, grounded) and ends <= {body, specs.GROUND}
        if not alone and not (section == "curves" and name not in slots):
            return False
    return True


EFFECTS: dict[str, Callable[[Scene], dict[str, Any]]] = {
    "clearance": lambda scene: _in_all_stages(scene, {"joints": _ideal}),
    "flexibility": lambda scene: _in_all_stages(scene, {"bodies": _rigid}),
    "impact": _without_impact,
    "friction": lambda scene: _in_all_stages(scene, {"joints": _smooth, "contacts": _smooth}),
    "damping": lambda scene: _in_all_stages(scene, {"bodies": _undamped, "springs": _lossless}),
}


def with_impact(scene: Scene, impact: str) -> Scene:
    """Return the scene with every contact's law an ``impulse`` or a ``penalty``.

    Restitution and friction stay.

    Raises:
        SceneError: a contact has no stiffness, so that there is no penalty to go back to, or a
            stop has a damper in place of a restitution.
        ValueError: there is no such impact.

    """
    if impact not in IMPACTS:
        raise ValueError(f"no impact '{impact}'; there is: {', '.join(IMPACTS)}")
    whole = specs.whole_scene(scene)
    if impact == "penalty":
        jumping = [name for name, law in whole.laws.items() if isinstance(law, specs.ImpulseLaw)]
        _refuse(whole, jumping, *NO_STIFFNESS)
        return scene
    touching = {**whole.contacts, **whole.stops}
    lossy = [name for name, contact in touching.items() if contact.law.restitution is None]
    _refuse(whole, lossy, *NO_RESTITUTION)
    changes = {
        "contacts": lambda contact: contact.model_copy(update={"law": _jumping(contact.law)}),
        "joints": _rigid_stops,
    }
    return scene.changed(**_in_all_stages(scene, changes))


def _rigid_stops(joint: specs.Joint) -> specs.Joint:
    """Return a joint whose limits or flanks, if any, act by impulses."""
    part = joint if isinstance(joint, specs.GearJoint) else getattr(joint, "limits", None)
    law = getattr(part, "law", None)
    return joint if law is None else _limited(joint, specs.ImpulseLaw(restitution=_returned(law)))


NO_RESTITUTION = (
    "no restitution is known, which an impulse needs",
    "give a 'restitution' in place of 'damping'",
)
NO_STIFFNESS = (
    "no stiffness is known, which a penalty needs",
    "give 'type: penalty' and a 'stiffness'",
)


def _limited(joint: specs.Joint, law: specs.ImpulseLaw | None) -> specs.Joint:
    """Return a joint with another law of its limits, if it has some; None: without limits.

    A gear has one of its flanks.
    """
    if isinstance(joint, specs.GearJoint):
        return joint if law is None else joint.model_copy(update={"law": law})
    limits = getattr(joint, "limits", None)
    if limits is None:
        return joint
    changed = None if law is None else limits.model_copy(update={"law": law})
    return joint.model_copy(update={"limits": changed})


def _jumping(law: specs.Law) -> specs.RubbingImpulse:
    """Return an impulse with the restitution and friction of a law; an impulse stays as it is."""
    if isinstance(law, specs.RubbingImpulse):
        return law
    return specs.RubbingImpulse(
        restitution=_returned(law), friction=law.friction, slip_speed=law.slip_speed
    )


def _returned(law: specs.Law | specs.StopLaw) -> float | None:
    """Actual restitution of a law, if it has one."""
    return law.returned if isinstance(law, specs.DampedLaw) else law.restitution


def _refuse(scene: Scene, contacts: Iterable[str], message: str, hint: str) -> None:
    """Refuse the laws of some contacts, if any; both stops of a joint share one law."""
    paths = dict.fromkeys(scene.law_path(name) for name in contacts)
    if paths:
        raise SceneError(scene.document, [Mistake(path, message, hint) for path in paths])
