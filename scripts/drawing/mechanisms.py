"""Families of random mechanisms: linkages, chains, points in slots, free bodies, cams, links."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drawing.added import add_parts
from drawing.linkages import bearing, four_bar, on_ground, slider_crank
from drawing.parts import (
    Drawn,
    Model,
    add_drive,
    add_springs,
    add_walls,
    angle,
    body,
    closed_curve,
    law,
    number,
    spread,
    within,
)
from drawing.staged import add_end, add_freewheel, add_stages

TOLERANCE = 1e-6  # m


def draw(rng: np.random.Generator, added: bool = False) -> tuple[str, Model]:
    """Draw a family, and a model of it; with parts `added` that any mechanism may have."""
    family = str(rng.choice(list(FAMILIES)))
    drawn = FAMILIES[family](rng)
    model = drawn.model
    if drawn.crank:
        add_drive(rng, drawn)
    if rng.random() < 0.6:
        model.setdefault("gravity", [0, -9.81])
    if not drawn.complete:
        add_springs(rng, drawn)
        if rng.random() < 0.6:
            add_walls(rng, drawn)
    if added:
        if family == "flexible link":
            model["bodies"]["link"]["rods"] = int(rng.integers(2, 4))  # parts take their time
        add_parts(rng, drawn)
    duration = within(rng, 0.1, 0.5) if added else within(rng, 0.3, 1.2)
    model["run"] = {"duration": duration, "sample": "2 ms"}
    model["accuracy"] = {"tolerance": TOLERANCE}
    if added:
        add_freewheel(rng, drawn)
        if stages := add_stages(rng, drawn, duration):
            model["stages"] = stages
        model["run"] |= add_end(rng, drawn, duration)
    return family, {"title": family, **model}


def _tree(rng: np.random.Generator) -> Drawn:
    """One to four bodies, on hinges or slides, some with springs."""
    angles: Model = {}
    speeds: Model = {}
    along: Model = {}
    sliding: Model = {}
    model: Model = {"bodies": {}, "joints": {}, "springs": {}}
    for k in range(int(rng.integers(1, 5))):
        name, joint, length = f"bar_{k}", f"joint_{k}", within(rng, 0.05, 0.25)
        ends = {"a": (0.0, 0.0), "b": (length, 0.0), "c": (length / 2, within(rng, -0.05, 0.05))}
        model["bodies"][name] = body(rng, ends)
        if k == 0:
            model["joints"][joint] = on_ground(f"{name}.a", 0.0)
            angles[name], speeds[name] = angle(rng), number(rng.normal(0, 5))
            continue
        points = [f"bar_{rng.integers(k)}.{rng.choice(['b', 'c'])}", f"{name}.a"]
        if rng.random() < 0.25:
            axis = [number(np.cos(k)), number(np.sin(k))]
            model["joints"][joint] = {"type": "prismatic", "points": points, "axis": axis}
            along[joint], sliding[joint] = within(rng, -0.05, 0.05), within(rng, -1, 1)
            spring = {"type": "linear", "stiffness": spread(rng, 50, 5e3), "length": 0.0}
        else:
            model["joints"][joint] = {"type": "revolute", "points": points}
            angles[name], speeds[name] = angle(rng), number(rng.normal(0, 5))
            spring = {"type": "torsional", "stiffness": spread(rng, 0.01, 10)}
        if joint in along or rng.random() < 0.5:
            damping = number(rng.choice([0, 1e-3 * spring["stiffness"]]))
            model["springs"][f"spring_{k}"] = {**spring, "joint": joint, "damping": damping}
    initial = {"angles": angles, "speeds": speeds, "along": along, "speeds_along": sliding}
    model["initial"] = {key: given for key, given in initial.items() if given}
    return Drawn(model, [f"{name}.{end}" for name in model["bodies"] for end in "bc"], "joint_0")


def _in_slot(rng: np.random.Generator) -> Drawn:
    """A point of a double pendulum runs along a closed curve."""
    curve, start = closed_curve(rng)
    ends = {"a": (0.0, 0.0), "b": (0.1, 0.0)}
    bars = ("bar_0", "bar_1")
    model = {
        "curves": {"track": curve},
        "bodies": {name: body(rng, ends) for name in bars},
        "joints": {
            "slot": {"type": "slot", "point": "bar_0.a", "curve": "track"},
            "hinge": {"type": "revolute", "points": ["bar_0.b", "bar_1.a"]},
        },
        "initial": {
            "positions": {"bar_0": start},
            "angles": {name: angle(rng) for name in bars},
            "speeds": {name: number(rng.normal(0, 5)) for name in bars},
            "speeds_along": {"slot": number(rng.normal(0, 1))},
        },
    }
    return Drawn(model, ["bar_0.b", "bar_1.b"])


def _free(rng: np.random.Generator) -> Drawn:
    """One to three bodies fall on a floor, and on one another."""
    model: Model = {"bodies": {}, "contacts": {}, "gravity": [0, -9.81]}
    initial: Model = {"positions": {}, "angles": {}, "speeds": {}, "velocities": {}}
    corners = {"a": (-0.05, 0.0), "b": (0.05, 0.0), "c": (0.0, 0.03)}
    model["curves"] = {"floor": {"type": "line", "from": [-1.5, 0.0], "to": [1.5, 0.0]}}
    floor = {"type": "point_on_curve", "curve": "floor", "side": "left", "law": law(rng)}
    for k in range(int(rng.integers(1, 4))):
        name = f"body_{k}"
        model["bodies"][name] = body(rng, corners)
        initial["positions"][name] = [number(-0.3 + 0.3 * k), within(rng, 0.1, 0.3)]
        initial["angles"][name] = angle(rng)
        initial["speeds"][name] = number(rng.normal(0, 8))
        initial["velocities"][name] = [number(v) for v in rng.normal(0, 0.7, 2)]
        for corner in corners:
            model["contacts"][f"{name}_{corner}"] = {**floor, "point": f"{name}.{corner}"}
    if len(model["bodies"]) > 1 and rng.random() < 0.6:
        circles = [{"at": "body_0.b", "radius": 0.03}, {"at": "body_1.a", "radius": 0.04}]
        model["contacts"]["balls"] = {
            "type": "circle_on_circle",
            "circles": circles,
            "law": law(rng),
        }
    return Drawn({**model, "initial": initial}, [], complete=True)


def _cam(rng: np.random.Generator) -> Drawn:
    """A cam that turns or rocks lifts a roller on a spring-loaded follower, which may jump."""
    curve, _ = closed_curve(rng)
    speed = spread(rng, 2, 60)
    turns = rng.random() < 0.5
    rocking = f"{number(speed * rng.uniform(0.01, 0.8))} rad/s * cos({speed} rad/s * t)"
    model = {
        "curves": {"rim": {**curve, "on": "cam"}},
        "bodies": {
            "cam": body(rng, {"hub": (0, 0), "mark": (0.1, 0)}),
            "follower": body(rng, {"roller": (0, 0), "top": (0, 0.1)}),
        },
        "joints": {
            "shaft": on_ground("cam.hub", 0.0),
            "guide": {
                "type": "prismatic",
                "points": ["ground", "follower.roller"],
                "at": [0, 0],
                "axis": [0, 1],
            },
        },
        "springs": {
            "spring": {
                "type": "linear",
                "joint": "guide",
                "stiffness": spread(rng, 300, 5000),
                "length": 0.05,
                "damping": number(rng.choice([0, 2])),
            }
        },
        "drives": {
            "motor": {
                "type": "speed",
                "joint": "shaft",
                "value": f"{speed} rad/s" if turns else rocking,
            }
        },
        "contacts": {
            "face": {
                "type": "point_on_curve",
                "point": "follower.roller",
                "curve": "rim",
                "side": "right",
                "radius": within(rng, 0.005, 0.02),
                "law": law(rng),
            }
        },
        "initial": {
            "angles": {"cam": 0.0},
            "along": {"guide": 0.22},
            "speeds_along": {"guide": 0.0},
        },
    }
    return Drawn(model, [], complete=True)


def _flexible(rng: np.random.Generator) -> Drawn:
    """A flexible link on a crank, welded or hinged to it."""
    link = {
        "type": "flexible",
        "length": within(rng, 0.15, 0.4),
        "material": "steel",
        "section": {"width": 0.02, "thickness": spread(rng, 5e-4, 3e-3)},
        "rods": int(rng.integers(2, 9)),
        "layout": str(rng.choice(["equal", "half_ends"])),
        "hinges": {"stiffness": "beam", "damping": number(rng.choice([0, rng.uniform(0, 1e-2)]))},
    }
    angles = {"crank": angle(rng)}
    held: Model = {"type": "weld", "angle": within(rng, -1, 1)}
    if rng.random() < 0.5:
        held, angles["link"] = {"type": "revolute"}, angle(rng)
    model = {
        "materials": {"steel": {"density": 7850, "youngs_modulus": "200 GPa"}},
        "bodies": {"crank": body(rng, {"a": (0, 0), "b": (0.1, 0)}), "link": link},
        "joints": {
            "hub": on_ground("crank.a", 0.0),
            "root": {**held, "points": ["crank.b", "link.start"]},
        },
        "initial": {"angles": angles},
    }
    return Drawn(model, ["link.end", "crank.b"], "hub")


FAMILIES: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "four-bar": four_bar,
    "slider-crank": slider_crank,
    "bearing": bearing,
    "tree": _tree,
    "slot": _in_slot,
    "free bodies": _free,
    "cam": _cam,
    "flexible link": _flexible,
}
