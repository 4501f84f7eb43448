"""What an effect costs in a step: when it acts, when it is there and rests, when it is absent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from benchmarks.measuring import Table
from benchmarks.stepping import Stepped, cost_per_step
from benchmarks.strike import ROOT, warm_up
from benchmarks.variants import BEAM, VARIANTS, Variant
from exudyn_flexlink import NotRepresentableError, Scene, load_scene
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.scene import Initial, SleeveJoint

WITH_STRIKE, WITHOUT = 0.36, 0.15  # s
QUICKER = 1 / 3
FAR = "joints.sleeve.clearance=1.0"  # m: no wall is near
FRICTION = "joints.sleeve.law.friction=0.15"
WALLS = "walls of the guide"
SPEED = 10.0  # rad/s of the crank


@dataclass(frozen=True)
class Effect:
    """Scenes of one effect in its states: absent, dormant (there, and resting), present."""

    name: str
    scenes: Mapping[str, Scene]
    duration: float = WITHOUT  # s, in which it acts


def scene_of(model: str, *settings: str) -> Scene:
    """A shipped model with `beam` stiffness."""
    return load_scene(ROOT / "models" / model, (BEAM, *settings))


def effects(variant: Variant) -> list[Effect]:
    """Effects whose cost is measured."""
    own = variant.stepping()
    strike = scene_of("no_clearance.yaml", *own)
    out_of_reach = scene_of("no_clearance.yaml", *own, "joints.pivot.at=[-0.5, 0]")
    loose, far, rough = (
        idealise(scene_of("clearance.yaml", *own, *more), ["impact"])
        for more in ((), (FAR,), (FAR, FRICTION))
    )
    smooth = scene_of("smooth.yaml", *own)
    return [
        Effect(
            "lever",
            {
                "absent": idealise(strike, ["impact"]),
                "dormant": out_of_reach,
                "present": strike,
            },
            WITH_STRIKE,
        ),
        Effect(
            WALLS,
            {"absent": without_sleeve(far), "dormant": far, "present": loose},
        ),
        Effect("friction of the walls", {"absent": far, "dormant": rough}),
        Effect(
            "damping of the hinges",
            {"absent": idealise(smooth, ["damping"]), "present": smooth},
        ),
        Effect(
            "weight",
            {"absent": smooth, "present": smooth.changed(gravity=(0.0, -9.81))},
        ),
    ]


def without_sleeve(scene: Scene) -> Scene:
    """The same mechanism with nothing between link and guide, moving as with a far wall."""
    joints = {name: j for name, j in scene.joints.items() if not isinstance(j, SleeveJoint)}
    x = 0.04 - 0.02  # m, from the crank to P at time 0
    start = Initial(
        angles={"link": 0.0}, speeds={"link": SPEED}, velocities={"link": (0.0, x * SPEED)}
    )
    return scene.changed(joints=joints, initial=start)


def pairs_of_walls(variant: Variant) -> int:
    """Number of contact pairs of link and guide."""
    mechanism = build_mechanism(scene_of("clearance.yaml", *variant.stepping()))
    return len(mechanism.channels[0].contacts)


def measure(variant: Variant, brief: bool, repeat: int) -> dict[str, dict[str, Stepped]]:
    """Cost of a step by effect and state; effects that the engine can't represent are left out."""
    warm_up(variant)
    found = {}
    for effect in effects(variant):
        lasts = effect.duration * variant.stretch * (QUICKER if brief else 1)
        cases = {state: (variant.engine, scene) for state, scene in effect.scenes.items()}
        try:
            found[effect.name] = cost_per_step(cases, dict.fromkeys(cases, lasts), repeat)
        except NotRepresentableError:
            continue
    return found


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    rows: list[tuple[str, ...]] = []
    told: list[str] = []
    for variant in VARIANTS:
        for effect, states in measure(variant, quick, repeat).items():
            rows.append((effect, variant.name, *_costs(states), _steps(states)))
            if "dormant" in states:
                told.append(f"{effect} {_ratio(states, 'dormant')} ({variant.name})")
            if effect == WALLS:
                each = (states["dormant"].cost / states["absent"].cost - 1) / pairs_of_walls(
                    variant
                )
                told[-1] += f", {100 * each:.1f} % of a step for each pair"
    return [
        Table(
            "Cost of a step with an effect absent, dormant and present, microseconds",
            ("effect", "variant", "absent", "dormant", "", "present", "", "steps"),
            tuple(rows),
            "Dormant over absent: " + ", ".join(told) + ".",
        ),
    ]


def _ratio(states: Mapping[str, Stepped], state: str) -> str:
    return f"{states[state].cost / states['absent'].cost:.2f}"


def _costs(states: Mapping[str, Stepped]) -> tuple[str, ...]:
    texts = [f"{1e6 * states['absent'].cost:.1f}"]
    for state in ("dormant", "present"):
        known = state in states
        texts += [f"{1e6 * states[state].cost:.1f}", _ratio(states, state)] if known else ["", ""]
    return tuple(texts)


def _steps(states: Mapping[str, Stepped]) -> str:
    return "/".join(str(stepped.steps) for stepped in states.values())
