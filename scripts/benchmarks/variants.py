"""Engines and formulations that are compared: a line here puts one into every part."""

from __future__ import annotations

from dataclasses import dataclass

BEAM = "bodies.link.hinges.stiffness=beam"


@dataclass(frozen=True)
class Variant:
    """One way to compute a scene.

    `settings` choose it. `accuracy` are settings that say how accurate it is to be: ``{x}`` stands
    for a rung of the ladder, which begins at `first`, and ``{small}`` for a hundredth of it.
    """

    name: str
    engine: str
    settings: tuple[str, ...]
    accuracy: tuple[str, ...]
    first: float

    def at(self, rung: float) -> tuple[str, ...]:
        """Settings of this variant at a rung."""
        told = (text.format(x=f"{rung:.17g}", small=f"{rung / 100:.17g}") for text in self.accuracy)
        return (*self.settings, *told)


VARIANTS = (
    Variant("exudyn", "exudyn", (), ("accuracy.tolerance={x}",), 1e-3),
    Variant(
        "lagrangian",
        "lagrangian",
        (),
        ("accuracy.relative_tolerance={x}", "accuracy.absolute_tolerance={small}"),
        1e-3,
    ),
)
