"""What runs of random mechanisms may have: freewheels, ends at a formula, stages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from drawing.parts import Drawn, Model, number, spread, within


def add_freewheel(rng: np.random.Generator, drawn: Drawn) -> None:
    """Let a hinge whose rate is known turn one way: not against it, nor against its drive."""
    model = drawn.model
    rates = dict(_rates(drawn))
    if not rates or rng.random() > 0.3:
        return
    name = str(rng.choice(list(rates)))
    forward = rates[name] > 0 or (rates[name] == 0 and rng.random() < 0.5)
    model["joints"][name]["freewheel"] = "forward" if forward else "backward"


def _rates(drawn: Drawn) -> Iterator[tuple[str, float]]:
    """Hinges without play, and how fast (rad/s) their second body turns in the first at first.

    A drive by motion turns both ways, so that its joint is left out.
    """
    model = drawn.model
    driven = {drive["joint"]: drive for drive in model.get("drives", {}).values()}
    speeds = {"ground": 0.0, **model["initial"].get("speeds", {})}
    for name, joint in model.get("joints", {}).items():
        if joint["type"] != "revolute" or "clearance" in joint:
            continue
        drive = driven.get(name, {"type": "none"})
        first, second = (point.split(".")[0] for point in joint["points"])
        if drive["type"] == "speed":
            rate = float(str(drive["value"]).split()[0])
            if "cos" not in str(drive["value"]):
                speeds[second] = rate
                yield name, rate
        elif drive["type"] != "motion" and first in speeds and second in speeds:
            yield name, speeds[second] - speeds[first]


def add_end(rng: np.random.Generator, drawn: Drawn, duration: float) -> Model:
    """Draw how a run ends: at an instant, at a state, which may never come, or by its duration."""
    if rng.random() < 0.5:
        return {}
    return {"until": _formula(rng, drawn, duration, later=0.6)}


def _formula(rng: np.random.Generator, drawn: Drawn, duration: float, later: float = 0.1) -> str:
    """Draw what rises through 0: time, a joint's force, a crank's angle, a point's way."""
    model = drawn.model
    instant = number(duration * rng.uniform(later, 1))
    gone = [part for stage in model.get("stages", ()) for part in stage.get("remove", ())]
    stays = drawn.crank and f"joints.{drawn.crank}" not in gone
    kinds = ["t", *(["angle", "force"] if stays else [])]
    kind = str(rng.choice([*kinds, "place"] if drawn.points else kinds))
    if kind == "angle":
        # Every crank is hinged to the ground by its origin.
        body = model["joints"][drawn.crank]["points"][1].split(".")[0]
        begin = model["initial"].get("angles", {}).get(body)
        if begin is not None:
            return f"abs(angle({drawn.crank}) - {begin}) - {spread(rng, 0.1, 100)}"
    if kind == "force":
        return f"min(t - 0.01, force({drawn.crank}) - {spread(rng, 30, 3000)} N)"
    if kind == "place":
        point = str(rng.choice(drawn.points))
        return f"min(t - 0.01, place({point}, {rng.choice(['x', 'y'])}) - {within(rng, -0.2, 0.4)})"
    return f"t - {instant}"


def add_stages(rng: np.random.Generator, drawn: Drawn, duration: float) -> list[Model]:
    """Draw up to two stages: one joint lets go, or is another from then on; others change."""
    model = drawn.model
    if rng.random() < 0.5:
        return []
    stages: list[Model] = [{"until": _formula(rng, drawn, duration)}]
    joints = [
        name
        for name, joint in model.get("joints", {}).items()
        if joint["type"] in {"revolute", "weld", "slot"} and "clearance" not in joint
    ]
    kind = str(rng.choice(["joint", "springs", "values"], p=[0.6, 0.2, 0.2]))
    if kind == "joint" and joints:
        _swap(rng, model, str(rng.choice(joints)), stages[0])
    elif kind == "springs":
        _respring(rng, drawn, stages[0])
    else:
        stages[0]["set"] = {"gravity": [within(rng, -5, 5), -9.81]}
        _reset(rng, model, stages[0]["set"])
    if rng.random() < 0.4:
        stages.append({"until": f"t - {number(duration * rng.uniform(0.5, 1))}"})
        stages[1]["set"] = {"gravity": 0}
    return stages


def _swap(rng: np.random.Generator, model: Model, name: str, stage: Model) -> None:
    """Let a joint go, with all that is on it; a weld, or a hinge for one, may be in its place."""
    joint = model["joints"][name]
    stage["remove"] = [f"joints.{name}", *_on(model, name)]
    if joint["type"] == "slot" or rng.random() < 0.4:
        return
    kept: dict[str, Any] = {key: joint[key] for key in ("points", "at") if key in joint}
    other = {"type": "revolute" if joint["type"] == "weld" else "weld"}
    stage["add"] = {"joints": {"latch": {**other, **kept}}}


def _on(model: Model, name: str) -> Iterator[str]:
    """Paths of the parts that refer to a joint by its name."""
    for section in ("joints", "springs", "drives"):
        for part, keys in model.get(section, {}).items():
            among = name == keys.get("joint") or name in keys.get("joints", ())
            if among or f"({name})" in str(keys.get("value")):
                yield f"{section}.{part}"


def _respring(rng: np.random.Generator, drawn: Drawn, stage: Model) -> None:
    """Take a spring away, if there is any; put one that rests as it stands then."""
    springs = list(drawn.model.get("springs", {}))
    if springs:
        stage["remove"] = [f"springs.{rng.choice(springs)}"]
    if drawn.points:
        spring = {
            "type": "linear",
            "points": ["ground", str(rng.choice(drawn.points))],
            "at": [within(rng, -0.4, 0.4), within(rng, 0.3, 0.6)],
            "stiffness": spread(rng, 10, 5e3),
            "damping": number(rng.choice([0, rng.uniform(0.1, 10)])),
        }
        stage["add"] = {"springs": {"later": spring}}


def _reset(rng: np.random.Generator, model: Model, values: Model) -> None:
    """Give a motor, and a spring's stiffness, another value."""
    motor = model.get("drives", {}).get("motor", {"type": "none"})
    if motor["type"] == "torque":
        values["drives.motor.value"] = 0
    elif motor["type"] == "speed":
        slower = within(rng, 0, 1)
        values["drives.motor.value"] = f"{slower} * {motor['value']}"
    for name, spring in model.get("springs", {}).items():
        if "stiffness" in spring:
            values[f"springs.{name}.stiffness"] = number(spring["stiffness"] * rng.uniform(0.2, 3))
