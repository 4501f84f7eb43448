"""Methods of a work-precision study: an engine, its formulation, and the setting that is varied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, log10
from typing import Any, Literal

from exudyn_flexlink.scene import Scene

Knob = Literal["tolerance", "step"]

BEAM = "beam"  # the one formulation whose link is not made of rods
TITLES = {"exudyn": "Exudyn", "lagrangian": "Lagrangian"}
LEAST_TOLERANCE = 1e-9  # m: finer rungs only where the target asks for them
COARSEST = 1e-3  # m: a ladder reaches up to it about, so that every method has cheap rungs
USUAL_TOLERANCE = 1e-4  # m: where the model gives a step instead
RUNGS_OF_STEPS = 6
REFERENCE = 1e-12
"""Tolerance (m) of the run against which everything else is judged: 100 times finer than the
finest rung, or more. The smooth method at 1e-12 m leaves 2e-13 m over the paper's two turns."""

_OF_THE_METHOD = ("formulation", "elements")


@dataclass(frozen=True)
class Method:
    """A way to solve a scene, up to one number: a tolerance (m) or a step (s).

    `settings` are keys of the scene's solver that make it this method.
    """

    name: str
    engine: str
    knob: Knob = "tolerance"
    settings: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def of_rods(self) -> bool:
        """Whether the link is made of rods, as the scene's; a beam tends to another motion."""
        return self.settings.get("formulation") != BEAM

    def at(self, scene: Scene, value: float) -> Scene:
        """Return the scene solved by this method at a value of its knob."""
        given = scene.solver.model_dump(exclude_unset=True)
        solver = {key: item for key, item in given.items() if key not in _OF_THE_METHOD}
        if not self.of_rods and "elements" in given:
            solver["elements"] = given["elements"]
        return scene.changed(
            accuracy=type(scene.accuracy).model_validate({self.knob: value}),
            solver=type(scene.solver).model_validate({**solver, **self.settings}),
        )

    def amount(self, value: float) -> str:
        """Say a value of the knob with its unit, such as '1e-05 m'."""
        return f"{value:.2g}{' s' if self.knob == 'step' else ' m'}"

    def set_to(self, value: float) -> str:
        """Say the knob at a value, such as 'tolerance 1e-05 m'."""
        return f"{self.knob} {self.amount(value)}"

    def told(self, value: float) -> str:
        """Say the method at a value, such as 'Exudyn, redundant, tolerance 1e-05 m'."""
        return f"{self.name.removesuffix(', fixed step')}, {self.set_to(value)}"


def methods_of(scene: Scene, formulations: Mapping[str, Sequence[str]]) -> list[Method]:
    """List the methods worth a try, that of the model's own settings first.

    `formulations` names, for each engine, the formulations that represent the scene, the one that
    the engine picks first; empty for an engine without a choice.
    """
    found: list[Method] = []
    for engine, names in formulations.items():
        title = TITLES.get(engine, engine)
        ways = ({"formulation": name} for name in names)
        found += [Method(f"{title}, {w['formulation']}", engine, settings=w) for w in ways]
        found += [] if names else [Method(title, engine)]
    if "exudyn" in formulations:  # the equal steps that anyone would script by hand
        settings = {"formulation": "redundant"} if "redundant" in formulations["exudyn"] else {}
        found.append(Method("Exudyn, fixed step", "exudyn", "step", settings))
    own = own_method(scene, found)
    return sorted(found, key=lambda method: method is not own)


def own_method(scene: Scene, methods: Sequence[Method]) -> Method:
    """Return the method that the model's settings mean: Exudyn, as `simulate` takes it."""
    knob = "tolerance" if scene.accuracy.step is None else "step"
    asked = scene.solver.formulation
    fitting = [m for m in methods if m.engine == "exudyn" and m.knob == knob]
    named = [m for m in fitting if m.settings.get("formulation") == asked]
    return (named or fitting or list(methods))[0]


def own_value(scene: Scene, method: Method) -> float | None:
    """Value of the method's knob that the model gives, or a usual one; None: unknown."""
    if method.knob == "step":
        return scene.accuracy.step
    return own_tolerance(scene)


def own_tolerance(scene: Scene) -> float:
    """Tolerance that the model gives, or a usual one, m."""
    return scene.accuracy.tolerance or USUAL_TOLERANCE


def ladder(knob: Knob, own: float, target: float) -> list[float]:
    """Values of a knob, finest last: own times powers of ten, of its root for steps.

    `target` (m) is the error that somebody wants: tolerances reach from above to below it.
    """
    if knob == "step":
        return [own * 10 ** (-k / 2) for k in range(-1, RUNGS_OF_STEPS)]
    top = max(1, ceil(log10(target / own) - 1e-9), round(log10(COARSEST / own)))
    least = min(LEAST_TOLERANCE, target / 10)
    count = top + max(0, int(log10(own / least) + 1e-9))
    return [own * 10.0 ** (top - k) for k in range(count + 1)]
