"""Joints whose forces have no answer, or more than one: friction, gears, joints that hold twice."""

from __future__ import annotations

from exudyn_flexlink.assembly_mistakes import path_of
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import Assembly, Slide, always_redundant, formulation, shared_forces
from exudyn_flexlink.mechanism.tree import tree_layout
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Mistake


def rubbing_badly(assembly: Assembly) -> list[Mistake]:
    """Friction in joints that has no answer, or that goes with nothing else in the scene."""
    mechanism, found = assembly.mechanism, []
    shared = shared_forces(assembly) if mechanism.frictions else set()
    for friction in mechanism.frictions:
        path = ("joints", friction.name, "friction")
        if any(isinstance(contact.law, Impulse) for contact in mechanism.contacts):
            message = "friction in joints does not go with contacts by impulse"
            found.append(Mistake(path, message, "give the contacts a law with stiffness"))
        if friction.share > 0 and friction.name in shared:
            message = "the force in this joint is not known: other joints hold the same"
            hint = "take one of them away; or give a torque, along a slide a force"
            found.append(Mistake((*path, "coefficient"), message, hint))
        if isinstance(friction.joint, Slide) and friction.name not in tree_layout(mechanism).joints:
            message = "friction of a slide that closes a loop of slides is not known"
            found.append(Mistake(path, message, "give it to another slide of the loop"))
    return found


def geared_badly(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Racks whose slide minimal coordinates do not have."""
    mechanism = assembly.mechanism
    slides = {
        tie.slide.name: gear.name for gear in mechanism.gears for tie in gear.ties if tie.slide
    }
    if not slides or formulation(scene) != "minimal":
        return []
    layout, hint = tree_layout(mechanism), "mesh with another slide of the loop"
    return [
        Mistake(
            ("joints", gear), f"'{slide}' closes a loop of slides: no gear is known there", hint
        )
        for slide, gear in slides.items()
        if slide not in layout.joints
    ]


def redundancies(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Joints and drives that hold what others hold already: forces in them have no one answer.

    Minimal coordinates leave joints out that others imply always; not those of a structure that
    nothing can move, nor drives.
    """
    moves = assembly.degrees_of_freedom > 0 or assembly.mechanism.speed_motors
    may = assembly.surplus and moves and not set(scene.drives) & set(assembly.surplus)
    if may and formulation(scene) == "minimal" and always_redundant(assembly):
        return []
    found = []
    hint = (
        "two joints do the same, two drives move one freedom, or the mechanism starts at a dead "
        "centre: take one away, or start at another angle; of a body pinned at both ends between "
        "parts that move alike, let one pin slide along it, in a slot"
    )
    for name, count in assembly.surplus.items():
        drive = name in scene.drives and name not in scene.joints
        what = "drive" if drive else "joint" if name in scene.joints else "body's hinge"
        times = "" if count == 1 else f" {count} times"
        path = ("drives", name) if drive else path_of(scene, name)
        found.append(Mistake(path, f"this {what} holds{times} what others hold already", hint))
    return found
