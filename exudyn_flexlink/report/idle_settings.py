"""Settings of a model that a run had no use for: said, so that nobody looks for their effect."""

from __future__ import annotations

from exudyn_flexlink.result import Result

_REDUNDANT = ("redundant", "beam")
_LAGRANGIAN = ("lagrangian",)
_USED_BY = {
    "steps_per_contact": _REDUNDANT,
    "spectral_radius": _REDUNDANT,
    "relative_tolerance": _LAGRANGIAN,
    "absolute_tolerance": _LAGRANGIAN,
}


def idle_settings(result: Result) -> list[str]:
    """Say which settings of `accuracy` stand in the model without a use in this run."""
    way = str(result.settings.get("formulation", result.engine))
    given = result.scene.accuracy.model_fields_set
    by = "the engine 'lagrangian'" if way == "lagrangian" else f"the formulation '{way}'"
    return [
        f"'accuracy.{name}' changes nothing: {by} has no use for it"
        for name, users in _USED_BY.items()
        if name in given and way not in users
    ]
