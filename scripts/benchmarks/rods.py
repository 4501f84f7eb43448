"""Cost of a step over the number of rods, in the smooth scene with `beam` stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from benchmarks.measuring import Table, exponent, timed
from benchmarks.stepping import Stepped, cost_per_step, lasting
from benchmarks.strike import ROOT, warm_up
from benchmarks.variants import BEAM, VARIANTS, Variant
from exudyn_flexlink import Scene, load_scene, simulate

RODS = (1, 2, 5, 10, 20, 50, 100)
STEPS_WANTED, ENOUGH = 500, 2.0  # steps of the long run, unless it costs so much (s)
FITTED = 10  # rods and more


def scene_with(variant: Variant, rods: int) -> Scene:
    """The smooth scene with `beam` stiffness, a number of rods, and what the variant steps by."""
    settings = (BEAM, f"bodies.link.rods={rods}", *variant.stepping())
    return load_scene(ROOT / "models" / "smooth.yaml", settings)


def measure(
    rods: Sequence[int] = RODS, repeat: int = 3, step_wanted: int = STEPS_WANTED
) -> dict[str, dict[int, Stepped]]:
    """Cost of a step by variant and number of rods."""
    for variant in VARIANTS:
        warm_up(variant)  # else importing counts as a long run
    # At large n preparing costs as much as the run: one sample of the difference is only noise.
    repeat = max(repeat, 2)
    return {v.name: {n: _one(v, n, repeat, step_wanted) for n in rods} for v in VARIANTS}


def _one(variant: Variant, rods: int, repeat: int, step_wanted: int) -> Stepped:
    """Cost of a step of a variant with a number of rods."""
    scene = scene_with(variant, rods)
    lasts = _duration(variant.engine, scene, step_wanted)
    return cost_per_step({"run": (variant.engine, scene)}, {"run": lasts}, repeat)["run"]


def _duration(engine: str, scene: Scene, wanted: int) -> float:
    """Duration (s) in which the engine makes enough steps, or which costs enough."""
    duration = 1e-4
    while True:
        result, cost = timed(partial(simulate, lasting(scene, duration), engine))
        steps = result.checks.steps
        if steps >= wanted or cost > ENOUGH:
            return duration
        duration *= min(10.0, max(2.0, 1.1 * wanted / steps))


def _known(costs: dict[int, Stepped], rods: Sequence[int]) -> list[tuple[float, float]]:
    """Numbers of rods and costs (s); what noise made negative is left out."""
    return [(float(n), costs[n].cost) for n in rods if costs[n].cost > 0]


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    rods = (1, 10, 30) if quick else RODS
    found = measure(rods, repeat, STEPS_WANTED // 2 if quick else STEPS_WANTED)
    fitted = [n for n in rods if n >= FITTED]
    powers = {
        name: exponent(*zip(*_known(costs, fitted), strict=True)) for name, costs in found.items()
    }
    rows = tuple(
        (name, *(f"{1e6 * costs[n].cost:.3g}" for n in rods), f"{powers[name]:.2f}")
        for name, costs in found.items()
    )
    flattest = min(powers, key=lambda name: powers[name])
    return [
        Table(
            "Cost of a step over the number of rods, microseconds",
            ("variant", *(f"n = {n}" for n in rods), "exponent"),
            rows,
            f"From {fitted[0]} to {fitted[-1]} rods a step of '{flattest}' grows as "
            f"n^{powers[flattest]:.2f}, the least of all.",
        )
    ]
