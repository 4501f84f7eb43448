"""A mechanism at rest, as a notebook asks for it."""

from __future__ import annotations

from dataclasses import dataclass, fields

from exudyn_flexlink.api.scenes import given_scene
from exudyn_flexlink.arguments import takes
from exudyn_flexlink.loading import rest_of_scene
from exudyn_flexlink.mechanism import Rest
from exudyn_flexlink.report import equilibrium_text, rest_told
from exudyn_flexlink.scene import Scene as PlainScene


@dataclass(frozen=True, repr=False)
class Equilibrium(Rest):
    """A mechanism where all forces balance: places, forces in joints, small motions about it."""

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
    rest = rest_of_scene(scene)
    return Equilibrium(*(getattr(rest, own.name) for own in fields(Rest)), scene)
