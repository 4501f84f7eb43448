"""What a run's own numbers say against it, whatever engine made it."""

from __future__ import annotations

from dataclasses import replace

from exudyn_flexlink.engines.diagnostics import consistency, contacts, effort, walls
from exudyn_flexlink.loading import assemble_scene, rest_of_scene
from exudyn_flexlink.mechanism import coarse_tolerance, input_notes
from exudyn_flexlink.result import Result


def diagnosed(result: Result) -> Result:
    """Return a run with warnings of all that is doubtful; failed, where it is no motion at all."""
    assembly = assemble_scene(result.scene)
    warnings = (
        *result.warnings,
        *input_notes(result.scene, assembly),
        *unstable_start(result),
        *contacts.few_steps(result),
        *walls.coarse_for_clearance(result),
        *walls.soft_walls(result),
        *walls.out_of_guides(result),
        *coarse_tolerance(result.scene, assembly),
        *consistency.doubts(result),
        *effort.many_iterations(result),
        *effort.tiny_steps(result),
        *assembly.mechanism.unfound,  # pulses of drives that vary too fast
        *effort.few_samples(result),
        *contacts.thin_overlaps(result),
        *contacts.deep_strikes(result),
        *contacts.beside_faces(result),
        *contacts.idle_contacts(result),
        *contacts.wound_springs(result),
    )
    failed = consistency.refusal(result) if result.outcome.completed else None
    return replace(result, warnings=warnings, outcome=failed or result.outcome)


def unstable_start(result: Result) -> list[str]:
    """Say that what starts at rest does not stay there."""
    if not result.scene.initial.at_rest:
        return []
    rest = rest_of_scene(result.scene)
    grows = f"small motions grow by exp({rest.growth:.4g} t/s)"
    return [] if rest.stable else [f"the rest at which it starts is unstable: {grows}"]
