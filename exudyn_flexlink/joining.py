"""One result of a run and of another that goes on from its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from math import pi
from typing import Any

import numpy as np

from exudyn_flexlink.continuing import continued
from exudyn_flexlink.intervals import FrictionHistory
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import carrying_joint, joint_angle, struck_bodies
from exudyn_flexlink.result import Checks, Result, later
from exudyn_flexlink.scene import Run, Scene
from exudyn_flexlink.variables import Variable, members

SERIES = (
    *("time", "poses", "rates", "drive_torques", "drive_forces", "joint_forces", "slot_forces"),
    *("spring_forces", "gear_forces", "gear_torques", "contacts", "bearings", "sleeves"),
    *("energy", "extremes"),
)
"""Fields of a result that go on from one run to the next."""
ROUNDING = 1e-12  # s: of the clock at which a run goes on


def joined(first: Result, second: Result) -> Result:
    """Return one result of a run and of one that goes on from its end.

    Raises:
        CannotContinueError: the first run can't be continued from its end.
        ValueError: the second run does not go on from there, or can't be joined.

    """
    _require_following(first, second)
    end = float(first.time[-1])
    second = later(second, end)
    own = {
        m.name: _joined(getattr(first, m.name), getattr(second, m.name), m.variable)
        for m in members(Result)
        if m.name in SERIES
    }
    energy, tail = first.energy, second.energy
    for name in ("stored", "dissipated", "supplied"):  # of a table or a formula: from its start on
        values, more = getattr(energy, name), getattr(tail, name)
        both = np.concatenate([values, values[-1] + (more[1:] - more[0])])
        own["energy"] = replace(own["energy"], **{name: both})
    own["frictions"] = {
        name: _rubbed(one, second.frictions[name], end) for name, one in first.frictions.items()
    }
    unknown = first.error.missing or first.error.stopped is not None
    whole = replace(
        first,
        **own,
        timings={key: x + second.timings.get(key, 0.0) for key, x in first.timings.items()},
        laps=(*first.laps, *second.laps),
        checks=_checks(first, second),
        warnings=tuple(dict.fromkeys([*first.warnings, *second.warnings])),
        outcome=replace(second.outcome, time=second.outcome.time + end),
        # What the second run makes of the first one's error nobody measured.
        error=first.error if unknown else replace(first.error, stopped=end),
    )
    return replace(whole, scene=first.scene.changed(run=_run(whole)))


def _require_following(first: Result, second: Result) -> None:
    """Refuse runs of which the second does not begin with the first one's end."""
    begin, end = second.scene.initial.clock - first.scene.initial.clock, float(first.time[-1])
    anew = not second.scene.initial.states
    told = ""
    if first.engine != second.engine:
        told = f"one is by {first.engine}, the other by {second.engine}"
    elif anew or abs(begin - end) > ROUNDING * max(1.0, end):
        own = "it starts anew" if anew else f"it begins at {begin:.9g} s"
        told = f"{own}, the first ends at {end:.9g} s; see Result.continued"
    else:
        meant, scene = continued(first), second.scene
        keys = [key for key in Scene.model_fields if key != "run"]
        others = [key for key in keys if getattr(meant, key) != getattr(scene, key)]
        told = f"they differ in {', '.join(others)}" if others else ""
        mechanism = build_mechanism(meant)
        for body in struck_bodies(meant):
            if not told and carrying_joint(meant, mechanism, body) is None:
                told = f"'{body}' is free, and its displacement is told from the start of each run"
    if told:
        raise ValueError(f"the second run does not go on from the first: {told}")


def _joined(first: Any, second: Any, own: Variable | None) -> Any:
    """Join arrays over time, and columns of touches and extremes, in whatever holds them.

    The sample at which both meet is that of the first run.
    """
    if isinstance(first, Mapping):
        return {key: _joined(value, second[key], own) for key, value in first.items()}
    if is_dataclass(first) and not isinstance(first, type):
        parts = {
            m.name: _joined(getattr(first, m.name), getattr(second, m.name), m.variable)
            for m in members(type(first))
        }
        return replace(first, **parts)
    assert own is not None
    if not own.dimensions:
        return max(first, second)  # the deepest penetration
    if not isinstance(first, np.ndarray):
        return first  # names
    return np.concatenate([first, second[1:] if own.dimensions.startswith("time") else second])


def _rubbed(first: FrictionHistory, second: FrictionHistory, at: float) -> FrictionHistory:
    """Dry friction of both, which meet at an instant (s): a rest that goes on there is one."""
    begin = np.concatenate([first.begin, second.begin])
    end = np.concatenate([np.minimum(first.end, at), second.end])
    goes_on = np.flatnonzero((end[:-1] == at) & (begin[1:] == at))
    return FrictionHistory(
        np.concatenate([first.torque, second.torque[1:]]),
        np.concatenate([first.lost, first.lost[-1] + second.lost[1:]]),
        np.delete(begin, goes_on + 1),
        np.delete(end, goes_on),
    )


def _checks(first: Result, second: Result) -> Checks:
    """Of every step of both; what the balance misses in the first is missed from there on."""
    missed = abs(float(first.energy.residual[-1])) + second.checks.energy_residual
    both = {name: (own, getattr(second.checks, name)) for name, own in vars(first.checks).items()}
    found = {name: max(pair) for name, pair in both.items()}
    found |= {name: sum(both[name]) for name in ("steps", "newton_iterations")}
    found |= {name: min(both[name]) for name in ("smallest_step", "steps_per_contact")}
    return Checks(**(found | {"energy_residual": max(first.checks.energy_residual, missed)}))


def _run(whole: Result) -> Run:
    """How long both took, as the first one's scene counts it."""
    run, end = whole.scene.run, float(whole.time[-1])
    if run.of is not None and (turned := np.ptp(joint_angle(whole, run.of)[[0, -1]])) > 0:
        most = None if run.at_most is None else end
        return Run(turns=float(turned) / (2 * pi), of=run.of, at_most=most, sample=run.sample)
    return Run(duration=end, sample=run.sample)
