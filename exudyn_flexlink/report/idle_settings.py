"""Settings of a model that a run had no use for: said, so that nobody looks for their effect."""

from __future__ import annotations

from pydantic import BaseModel

from exudyn_flexlink.result import Result

_REDUNDANT = ("redundant", "beam")
_LAGRANGIAN = ("lagrangian",)
_USED_BY = {
    ("solver", "steps_per_contact"): _REDUNDANT,
    ("solver", "spectral_radius"): _REDUNDANT,
    ("solver", "integrator"): _LAGRANGIAN,
}


def idle_settings(result: Result) -> list[str]:
    """Say which settings of how to solve the model had no use in this run.

    What has its default counts as not given: saved scenes say everything.
    """
    way = str(result.settings.get("formulation", result.engine))
    by = "the engine 'lagrangian'" if way == "lagrangian" else f"the formulation '{way}'"
    return [
        f"'{section}.{name}' changes nothing: {by} has no use for it"
        for (section, name), users in _USED_BY.items()
        if way not in users and not _is_default(getattr(result.scene, section), name)
    ]


def _is_default(part: BaseModel, name: str) -> bool:
    return bool(getattr(part, name) == type(part).model_fields[name].default)
