"""A mechanism at rest, as a notebook asks for it."""

from __future__ import annotations

from dataclasses import dataclass

from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.scenes import given_scene
from exudyn_flexlink.arguments import takes
from exudyn_flexlink.loading import rest_of_scene
from exudyn_flexlink.mechanism import Rest
from exudyn_flexlink.report import equilibrium_text, rest_told
from exudyn_flexlink.scene import Scene as PlainScene


@dataclass(frozen=True, repr=False)
class Equilibrium(Rest):
    """A mechanism where all forces balance; frozen, in SI units.

    ``poses["arm"]`` is [x, y, angle] of a body (of a flexible one, of its rods) and
    ``points["arm.end"]`` the place of a point. ``forces["pin"]`` [x, y] N acts on the body of a
    joint's second point, as ``torques["weld"]`` N m does; ``drives["motor"]`` is what a drive holds
    (N m, or N), ``gears["mesh"]`` the tangential force of a gear or a belt (N; N m without pitch
    circles), and ``presses["floor"]`` N the force of a contact. Undamped small motions have the
    `frequencies` (Hz; 0: nothing resists), and it is `stable` unless one grows, at the rate
    `growth` (1/s). `notes` tell what else is to be known, as of an unstable balance left.
    """

    scene: PlainScene

    def summary(self) -> str:
        """Return what ``check --equilibrium`` tells."""
        return equilibrium_text(self.scene, self)

    def __repr__(self) -> str:
        """Return one line: whether it is stable, and its lowest frequency."""
        moving = self.frequencies[self.frequencies > 0]
        lowest = f", lowest frequency {moving[0]:.5g} Hz" if len(moving) else ""
        return f"<Equilibrium of '{self.scene.title}': {rest_told(self)}{lowest}>"


@takes(scene=given_scene)
def equilibrium(scene: PlainScene) -> Equilibrium:
    """Find where all forces balance while drives hold what they have at time 0.

    It is searched downhill from the assembled start, whether or not the scene says
    ``initial: {at_rest: true}``. Dry friction and dampers do nothing there.

    Raises:
        SceneError: nothing balances, or only a contact by impulse could hold it.

    """
    return with_methods(Equilibrium, rest_of_scene(scene), scene=scene)
