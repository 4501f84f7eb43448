"""What a scene asks for, changed: a scene in, a checked scene out."""

from __future__ import annotations

from exudyn_flexlink.scene import ContactLaw, ImpulseLaw, Law, PointOnLine, Scene
from exudyn_flexlink.source import Mistake, SceneError

IMPACTS = ("penalty", "impulse")


def with_impact(scene: Scene, impact: str) -> Scene:
    """Return the scene with every contact's law an ``impulse`` or a ``penalty``, same restitution.

    Raises:
        SceneError: a contact has no stiffness, so that there is no penalty to go back to.
        ValueError: there is no such impact.

    """
    if impact not in IMPACTS:
        raise ValueError(f"no impact '{impact}'; there is: {', '.join(IMPACTS)}")
    if impact == "penalty":
        _require_stiffness(scene)
    contacts = {name: _changed(contact, impact) for name, contact in scene.contacts.items()}
    return scene.changed(contacts=contacts)


def _require_stiffness(scene: Scene) -> None:
    mistakes = [
        Mistake(
            ("contacts", name, "law"),
            "no stiffness is known, which a penalty needs",
            "give 'type: penalty' and a 'stiffness'",
        )
        for name, contact in scene.contacts.items()
        if not isinstance(contact.law, ContactLaw)
    ]
    if mistakes:
        raise SceneError(scene.document, mistakes)


def _changed(contact: PointOnLine, impact: str) -> PointOnLine:
    law: Law = contact.law
    if impact == "impulse":
        law = ImpulseLaw(restitution=contact.law.restitution)
    return contact.model_copy(update={"law": law})
