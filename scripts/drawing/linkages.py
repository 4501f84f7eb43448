"""Random linkages with closed loops: four-bars, some with a dyad, and slider-cranks."""

from __future__ import annotations

from math import sqrt

import numpy as np

from drawing.parts import Drawn, Model, angle, body, law, number, spread, within


def on_ground(point: str, x: float, y: float = 0.0) -> Model:
    """A hinge of a point on the ground, at x and y (m)."""
    return {"type": "revolute", "points": ["ground", point], "at": [number(x), number(y)]}


def four_bar(rng: np.random.Generator) -> Drawn:
    """A crank that can turn (Grashof); in half of all two more bars hang on the coupler."""
    crank, ground, coupler, rocker = _grashof(rng)
    start = angle(rng)
    pin, foot = crank * complex(np.exp(1j * start)), complex(ground)
    joint = _meeting(pin, foot, coupler, rocker)
    assert joint is not None  # a crank that can turn closes anywhere
    pen = (coupler / 2, within(rng, -0.2, 0.2))
    model = {
        "bodies": {
            "crank": body(rng, {"a": (0, 0), "b": (crank, 0)}),
            "coupler": body(rng, {"a": (0, 0), "b": (coupler, 0), "pen": pen}),
            "rocker": body(rng, {"a": (0, 0), "b": (rocker, 0)}),
        },
        "joints": {
            "hub": on_ground("crank.a", 0.0),
            "first": {"type": "revolute", "points": ["crank.b", "coupler.a"]},
            "second": {"type": "revolute", "points": ["coupler.b", "rocker.b"]},
            "foot": on_ground("rocker.a", ground),
        },
        "initial": {
            "angles": {"crank": start},
            "guesses": {"coupler": _direction(pin, joint), "rocker": _direction(foot, joint)},
        },
    }
    drawn = Drawn(model, ["coupler.pen", "coupler.b", "crank.b"], "hub", loop=True)
    if rng.random() < 0.5:
        _add_dyad(rng, drawn, pin + complex(*pen) * (joint - pin) / coupler)
    return drawn


def slider_crank(rng: np.random.Generator) -> Drawn:
    """A crank that can turn; the slider's way passes beside its hub."""
    crank = within(rng, 0.05, 0.15)
    rod, aside = number(crank * rng.uniform(1.4, 4)), number(crank * rng.uniform(-0.3, 0.3))
    model = {
        "bodies": {
            "crank": body(rng, {"a": (0, 0), "b": (crank, 0)}),
            "rod": body(rng, {"a": (0, 0), "b": (rod, 0), "pen": (rod / 2, 0.05)}),
            "slider": body(rng, {"pin": (0, 0), "corner": (0.05, 0.03)}),
        },
        "joints": {
            "hub": on_ground("crank.a", 0.0),
            "first": {"type": "revolute", "points": ["crank.b", "rod.a"]},
            "second": {"type": "revolute", "points": ["rod.b", "slider.pin"]},
            "way": {
                "type": "prismatic",
                "points": ["ground", "slider.pin"],
                "at": [0, aside],
                "axis": [1, 0],
            },
        },
        "initial": {"angles": {"crank": angle(rng)}, "guesses": {"rod": 0.0}},
    }
    return Drawn(model, ["slider.pin", "rod.pen", "crank.b"], "hub", loop=True)


def bearing(rng: np.random.Generator) -> Drawn:
    """A slider-crank with play between rod and slider."""
    drawn = slider_crank(rng)
    joint = {"clearance": spread(rng, 5e-5, 1e-3), "law": law(rng, rigid=False)}
    if "friction" in joint["law"]:
        joint["radius"] = 0.01
    drawn.model["joints"]["second"] |= joint
    return drawn


def _grashof(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Draw lengths (m) of crank, ground, coupler and rocker of which the crank can turn."""
    while True:
        crank, ground = within(rng, 0.04, 0.12), within(rng, 0.15, 0.4)
        coupler, rocker = within(rng, 0.15, 0.45), within(rng, 0.15, 0.45)
        longest = max(ground, coupler, rocker)
        if crank + 2 * longest < ground + coupler + rocker:
            return crank, ground, coupler, rocker


def _add_dyad(rng: np.random.Generator, drawn: Drawn, pen: complex) -> None:
    """Hang an arm on the coupler's pen (m), and on a bar on the ground; not if they do not meet."""
    stand = pen + within(rng, 0.25, 0.35) * complex(np.exp(1j * angle(rng)))
    arm, swing = within(rng, 0.2, 0.4), within(rng, 0.2, 0.4)
    joint = _meeting(pen, stand, arm, swing)
    if joint is None:
        return
    model = drawn.model
    model["bodies"] |= {
        "arm": body(rng, {"a": (0, 0), "b": (arm, 0)}),
        "swing": body(rng, {"a": (0, 0), "b": (swing, 0)}),
    }
    model["joints"] |= {
        "third": {"type": "revolute", "points": ["coupler.pen", "arm.a"]},
        "fourth": {"type": "revolute", "points": ["arm.b", "swing.b"]},
        "stand": on_ground("swing.a", stand.real, stand.imag),
    }
    model["initial"]["guesses"] |= {
        "arm": _direction(pen, joint),
        "swing": _direction(stand, joint),
    }
    drawn.points.append("arm.b")


def _meeting(one: complex, other: complex, near: float, far: float) -> complex | None:
    """Where bars of these lengths from two points (m) meet, left of the line between them."""
    between = other - one
    along = (near * near - far * far + abs(between) ** 2) / (2 * abs(between))
    square = near * near - along * along
    return one + between / abs(between) * complex(along, sqrt(square)) if square > 0 else None


def _direction(begin: complex, end: complex) -> float:
    return number(float(np.angle(end - begin)))
