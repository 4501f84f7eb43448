"""Where errors come from besides time: the number of rods, contacts that give way.

A scene is changed in one of them; what S makes of it, extrapolated, is the error of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from exudyn_flexlink.scene import DampedLaw, FlexibleBody, HertzLaw, ImpulseLaw, Joint, Scene

MORE_RODS = 2
STIFFER = 4.0
MOST_RODS = 1000  # of a model
COMPLIANCE_ORDER = 0.5
"""A contact's effect on the motion goes as k^-1/2, like its duration."""

ORDERS = {"equal": 1, "half_ends": 2}
"""A rigid root rod shortens the beam by half a rod; a hinge in the middle of each cell doesn't."""


@dataclass(frozen=True)
class Finer:
    """A scene `ratio` times finer in one source of error, which falls with the power `order`."""

    kind: str
    scene: Scene
    ratio: float
    order: float


def finer_scenes(scene: Scene) -> list[Finer]:
    """Return a scene with more rods, and with stiffer contacts, if it has what that changes."""
    rods, stiffer = with_more_rods(scene), with_stiffer_contacts(scene)
    found = []
    if rods is not None:
        order = min(ORDERS[body.layout] for body in beams(scene).values())  # of the slowest
        found.append(Finer("rods", rods, MORE_RODS, order))
    if stiffer is not None:
        found.append(Finer("contact", stiffer, STIFFER, COMPLIANCE_ORDER))
    return found


def extrapolated(ratio: float, order: float) -> float:
    """Error of a coarse answer over its distance from one `ratio` times finer, of a known order."""
    return 1 / (1 - float(ratio**-order))


def beams(scene: Scene) -> dict[str, FlexibleBody]:
    """Flexible bodies whose rods tend to a beam as they get more: hinges 'beam'."""
    return {name: body for name, body in flexible(scene).items() if body.hinges.stiffness == "beam"}


def flexible(scene: Scene) -> dict[str, FlexibleBody]:
    """Flexible bodies with hinges at all, by name."""
    return {
        name: body
        for name, body in scene.bodies.items()
        if isinstance(body, FlexibleBody) and (body.rods > 1 or body.hinges.stiffness == "beam")
    }


def with_more_rods(scene: Scene) -> Scene | None:
    """Return the scene with twice the rods in every 'beam'; None if there is none, or no room.

    The damping of a hinge is doubled like its stiffness, so that it is that of the same beam.
    """
    found = beams(scene)
    if not found or any(MORE_RODS * body.rods > MOST_RODS for body in found.values()):
        return None
    return scene.changed(bodies=dict(scene.bodies) | {n: _finer(b) for n, b in found.items()})


def _finer(body: FlexibleBody) -> FlexibleBody:
    hinges = body.hinges.model_copy(update={"damping": MORE_RODS * body.hinges.damping})
    return body.model_copy(update={"rods": MORE_RODS * body.rods, "hinges": hinges})


def stiffnesses(scene: Scene) -> dict[str, float]:
    """Stiffness of all contacts that give way, in joints and at their stops, too, by name.

    In N/m, N/m^n, or N m/rad. One that follows from materials is no stand-in for a rigid contact,
    and left out.
    """
    giving = {n: law for n, law in scene.laws.items() if not isinstance(law, ImpulseLaw)}
    return {n: law.stiffness for n, law in giving.items() if law.stiffness is not None}


def with_stiffer_contacts(scene: Scene) -> Scene | None:
    """Return the scene with contacts, walls and stops four times as stiff; None without any."""
    if not stiffnesses(scene):
        return None
    contacts = {name: _stiffer(part) for name, part in scene.contacts.items()}
    joints = {name: _stiffer_joint(joint) for name, joint in scene.joints.items()}
    return scene.changed(contacts=contacts, joints=joints)


def _stiffer_joint(joint: Joint) -> Joint:
    """Return a joint with stiffer walls, if it has some that press, and stiffer stops."""
    if getattr(joint, "acting", None):
        joint = _stiffer(joint)
    limits = getattr(joint, "limits", None)
    return joint.model_copy(update={"limits": _stiffer(limits)}) if limits else joint


def _stiffer(part: Any) -> Any:
    """Return what has a law with a stiffer one, if it is one with a stiffness."""
    law = part.law
    if isinstance(law, ImpulseLaw) or law.stiffness is None:
        return part
    # A contact lasts as K^(-1/(n + 1)): whatever the exponent n, all get shorter by one ratio.
    exponent = law.exponent or 1.5 if isinstance(law, DampedLaw | HertzLaw) else 1.0
    update = {"stiffness": STIFFER ** ((exponent + 1) / 2) * law.stiffness}
    if getattr(law, "damping", None):  # of a stop, which returns as much as before
        update["damping"] = STIFFER**0.5 * law.damping
    return part.model_copy(update={"law": law.model_copy(update=update)})
