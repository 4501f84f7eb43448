"""Settings of a model that a run had no use for: said, so that nobody looks for their effect."""

from __future__ import annotations

from exudyn_flexlink.result import Result

_REDUNDANT = ("redundant", "beam")
_LAGRANGIAN = ("lagrangian",)
_USED_BY = {
    ("solver", "steps_per_contact"): _REDUNDANT,
    ("solver", "spectral_radius"): _REDUNDANT,
    ("solver", "integrator"): _LAGRANGIAN,
}


def idle_settings(result: Result) -> list[str]:
    """Say which settings of how to solve the model had no use in this run."""
    way = str(result.settings.get("formulation", result.engine))
    by = "the engine 'lagrangian'" if way == "lagrangian" else f"the formulation '{way}'"
    return [
        f"'{section}.{name}' changes nothing: {by} has no use for it"
        for (section, name), users in _USED_BY.items()
        if name in getattr(result.scene, section).model_fields_set and way not in users
    ]
