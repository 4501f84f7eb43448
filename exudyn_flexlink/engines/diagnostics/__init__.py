"""What a run's own numbers say against it, whatever engine made it."""

from __future__ import annotations

from dataclasses import replace

from exudyn_flexlink.engines.diagnostics.consistency import doubts, refusal
from exudyn_flexlink.engines.diagnostics.contacts import (
    beside_faces,
    deep_strikes,
    few_steps,
    idle_contacts,
    thin_overlaps,
    wound_springs,
)
from exudyn_flexlink.engines.diagnostics.effort import (
    few_samples,
    many_iterations,
    tiny_steps,
    unfound_pulses,
)
from exudyn_flexlink.engines.diagnostics.walls import (
    coarse_for_clearance,
    out_of_guides,
    soft_walls,
)
from exudyn_flexlink.loading import assemble_scene, rest_of_scene
from exudyn_flexlink.mechanism import coarse_tolerance, input_notes
from exudyn_flexlink.result import Result


def diagnosed(result: Result) -> Result:
    """Return a run with warnings of all that is doubtful; failed, where it is no motion at all."""
    warnings = (
        *result.warnings,
        *input_notes(result.scene, assemble_scene(result.scene)),
        *unstable_start(result),
        *few_steps(result),
        *coarse_for_clearance(result),
        *soft_walls(result),
        *out_of_guides(result),
        *coarse_tolerance(result.scene, assemble_scene(result.scene)),
        *doubts(result),
        *many_iterations(result),
        *tiny_steps(result),
        *unfound_pulses(result),
        *few_samples(result),
        *thin_overlaps(result),
        *deep_strikes(result),
        *beside_faces(result),
        *idle_contacts(result),
        *wound_springs(result),
    )
    failed = refusal(result) if result.outcome.completed else None
    return replace(result, warnings=warnings, outcome=failed or result.outcome)


def unstable_start(result: Result) -> list[str]:
    """Say that what starts at rest does not stay there."""
    if not result.scene.initial.at_rest:
        return []
    rest = rest_of_scene(result.scene)
    grows = f"small motions grow by exp({rest.growth:.4g} t/s)"
    return [] if rest.stable else [f"the rest at which it starts is unstable: {grows}"]
