"""What may be added to random mechanisms: friction, stops, laws, springs, corners, gears, play."""

from __future__ import annotations

import numpy as np

from drawing.parts import Drawn, Model, law, number, spread, within

LAWS = ("hunt_crossley", "lankarani_nikravesh", "flores", "gonthier", "exact")
DEPTH = 1e-4  # m: here a law by a power presses as the linear one that it stands for


def add_parts(rng: np.random.Generator, drawn: Drawn) -> None:
    """Add some of all parts to a model, at least one where there is a place for it."""
    model = drawn.model
    for contact in model.get("contacts", {}).values():
        contact["law"] = _damped(rng, contact["law"])
    joints = [
        name
        for name, joint in model["joints"].items()
        if joint["type"] in {"revolute", "prismatic"} and "clearance" not in joint
    ] if "joints" in model else []  # fmt: skip
    for name in joints:
        if rng.random() < 0.4:
            _rub(rng, model["joints"][name])
        elif rng.random() < 0.4 and name == drawn.crank:
            _stop(rng, model["joints"][name])
    if drawn.points and rng.random() < 0.5:
        _hang(rng, drawn)
    if drawn.crank and rng.random() < 0.5:
        _gear(rng, drawn)
    if drawn.crank and rng.random() < 0.3:
        torque = f"{-spread(rng, 0.05, 2)} N m * sin(angle)"
        kinked = {"points": [[-20, -1.0], [0, 0], [0.5, 0.3], [20, 2.0]], "rule": "linear"}
        by_angle = torque if rng.random() < 0.5 else kinked
        spring = {"type": "torsional", "joint": drawn.crank, "torque": by_angle}
        model.setdefault("springs", {})["coil"] = spring
    if drawn.points and rng.random() < 0.3:
        _damp_by_rate(rng, drawn)
    curves = model.get("curves", {})
    curves |= {name: _cornered(rng, curve) for name, curve in curves.items()}
    _loosen(rng, model)
    if drawn.points and rng.random() < 0.4:
        _reeve(rng, drawn)


def _loosen(rng: np.random.Generator, model: Model) -> None:
    """Give play to slots."""
    for joint in model.get("joints", {}).values():
        if joint["type"] == "slot" and rng.random() < 0.6:
            joint |= {"clearance": spread(rng, 5e-5, 1e-3), "radius": 0.002, "law": law(rng)}


def _damped(rng: np.random.Generator, linear: Model) -> Model:
    """Return another law in place of half the linear ones; impulses may rub."""
    if linear.get("type") == "impulse":
        rubs = {"friction": within(rng, 0.05, 0.5)} if rng.random() < 0.4 else {}
        return {**linear, **rubs}
    if rng.random() < 0.5:
        return linear
    kind = str(rng.choice(LAWS))
    stiffness = number(linear["stiffness"] / np.sqrt(DEPTH))
    returned = max(linear["restitution"], 0.05)
    if kind in {"flores", "gonthier", "exact"}:
        returned = min(max(returned, 0.1), 1.0)
    kept = {"friction": linear["friction"]} if "friction" in linear else {}
    return {"type": kind, "stiffness": stiffness, "restitution": returned, **kept}


def _rub(rng: np.random.Generator, joint: Model) -> None:
    by_force = rng.random() < 0.3
    if joint["type"] == "prismatic":
        own = {"coefficient": 0.1} if by_force else {"force": spread(rng, 0.1, 10)}
    elif by_force:
        own = {"coefficient": within(rng, 0.05, 0.3), "radius": 0.005}
    else:
        own = {"torque": spread(rng, 1e-3, 0.5)}
    joint["friction"] = own


def _stop(rng: np.random.Generator, joint: Model) -> None:
    """Let a crank turn by two turns at most, either way, from wherever it starts."""
    if joint["type"] != "revolute":
        return
    at_stop = {"stiffness": spread(rng, 100, 1e4)}
    if rng.random() < 0.5:
        at_stop["damping"] = number(rng.choice([0, 1e-3 * at_stop["stiffness"]]))
    else:
        at_stop |= {"restitution": within(rng, 0, 1), "transition_speed": 0.01}
    joint["limits"] = {"from": -6.5, "to": 6.5, "law": at_stop}


def _hang(rng: np.random.Generator, drawn: Drawn) -> None:
    """Hold a point by a rope, or push it away by a buffer."""
    spring = {
        "type": "linear",
        "points": ["ground", str(rng.choice(drawn.points))],
        "at": [within(rng, -0.3, 0.3), within(rng, 0.3, 0.6)],
        "acts": str(rng.choice(["tension", "compression"])),
        "length": within(rng, 0.3, 0.5),
        "stiffness": spread(rng, 50, 5e3),
        "damping": number(rng.choice([0, rng.uniform(0.1, 10)])),
    }
    drawn.model.setdefault("springs", {})["rope"] = spring


def _reeve(rng: np.random.Generator, drawn: Drawn) -> None:
    """Lead a rope over an eye, or over another point of a body, to a point; it may be wound."""
    points = [str(name) for name in rng.permutation(drawn.points)[:2]]
    eyes = [[within(rng, -0.6, 0.6), within(rng, 0.3, 0.6)] for _ in points]
    length = within(rng, 0.6, 1.2)
    rope = {
        "type": "rope",
        "over": [points[0], eyes[0], *([points[1], eyes[1]] if len(points) > 1 else [[0, 0.7]])],
        "stiffness": spread(rng, 50, 5e3),
        "damping": number(rng.choice([0, rng.uniform(0.1, 10)])),
        "length": length if rng.random() < 0.5 else f"{length} m + 0.05 m * sin(5 rad/s * t)",
    }
    drawn.model.setdefault("springs", {})["reeved"] = rope


def _cornered(rng: np.random.Generator, curve: Model) -> Model:
    """Return a rectangle with rounded corners in place of half the curves of two half ellipses."""
    if curve["type"] != "joined" or rng.random() < 0.5:
        return curve
    (right, height), (left, _) = (piece["semi_axes"] for piece in curve["pieces"])
    points = [[right, -height], [right, height], [-left, height], [-left, -height]]
    radius = number(min(height, (right + left) / 2) * rng.uniform(0.1, 0.9))
    kept = {key: value for key, value in curve.items() if key not in {"type", "pieces"}}
    return {**kept, "type": "polygon", "points": points, "closed": True, "round": radius}


def _damp_by_rate(rng: np.random.Generator, drawn: Drawn) -> None:
    """Hold a point by a damper with two coefficients, with a spring or without."""
    stiffness, out, back = (spread(rng, low, 100 * low) for low in (5, 0.1, 0.1))
    spring = f"{stiffness} N/m * (length - 0.3 m) + " if rng.random() < 0.5 else ""
    drawn.model.setdefault("springs", {})["shock"] = {
        "type": "linear",
        "points": ["ground", str(rng.choice(drawn.points))],
        "at": [within(rng, -0.4, 0.4), within(rng, 0.3, 0.6)],
        "force": f"{spring}{out} N s/m * max(0, rate) + {back} N s/m * min(0, rate)",
    }


def _gear(rng: np.random.Generator, drawn: Drawn) -> None:
    """Let a crank on the ground turn a wheel by gears or by a belt."""
    model = drawn.model
    joint = model["joints"][drawn.crank]
    # A coefficient acts on the force in a joint, which is not known of a joint with gears.
    if joint["points"][0] != "ground" or "coefficient" in joint.get("friction", {}):
        return
    wheel = {"type": "rigid", "mass": 0.3, "inertia": spread(rng, 1e-5, 1e-3)}
    model["bodies"]["wheel"] = {**wheel, "points": {"hub": [0, 0]}}
    model["joints"]["axle"] = {
        "type": "revolute",
        "points": ["ground", "wheel.hub"],
        "at": [within(rng, 0.1, 0.3), within(rng, -0.3, -0.1)],
    }
    tie: Model = {"type": "belt", "radii": [0.03, within(rng, 0.02, 0.06)]}
    if rng.random() < 0.6:
        tie = {"type": "gear", "ratio": within(rng, 0.3, 3), "internal": bool(rng.random() < 0.3)}
    if tie["type"] == "gear" and rng.random() < 0.7:
        play = spread(rng, 1e-4, 0.02)
        teeth = {"stiffness": spread(rng, 100, 1e4), "restitution": within(rng, 0, 1)}
        stiff = {**teeth, "transition_speed": 0.01}
        hard = {"type": "impulse", "restitution": within(rng, 0, 0.9)}
        law = stiff if rng.random() < 0.5 else hard
        tie |= {"backlash": play, "start": number(play * rng.uniform(-0.5, 0.5)), "law": law}
    model["joints"]["mesh"] = {**tie, "joints": [drawn.crank, "axle"]}
