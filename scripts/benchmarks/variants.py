"""Engines and formulations that are compared: a line here puts one into every part."""

from __future__ import annotations

from dataclasses import dataclass

BEAM = "bodies.link.hinges.stiffness=beam"


@dataclass(frozen=True)
class Variant:
    """One way to compute a scene.

    `settings` choose it. `accuracy` are settings that say how accurate it is to be: ``{x}`` stands
    for a rung of the ladder, which begins at `first`. `steady` are those by which the cost of a
    step is told: equal steps where the method has such, else a tolerance. Then steps are long, so
    that it takes `stretch` times the motion to make enough of them.
    """

    name: str
    engine: str
    settings: tuple[str, ...]
    accuracy: tuple[str, ...] = ("accuracy.tolerance={x}",)
    first: float = 1e-3
    steady: tuple[str, ...] = ("accuracy.tolerance=1e-8",)
    stretch: float = 6.0

    def at(self, rung: float) -> tuple[str, ...]:
        """Settings of this variant at a rung."""
        return (*self.settings, *(text.format(x=f"{rung:.17g}") for text in self.accuracy))

    def stepping(self) -> tuple[str, ...]:
        """Settings of this variant where the cost of a step is told."""
        return (*self.settings, *self.steady)


VARIANTS = (
    Variant("Exudyn, minimal", "exudyn", ("solver.formulation=minimal",)),
    Variant(
        "Exudyn, redundant",
        "exudyn",
        ("solver.formulation=redundant",),
        steady=("accuracy.step=1e-4",),
        stretch=1.0,
    ),
    Variant("Lagrangian", "lagrangian", ()),
)
