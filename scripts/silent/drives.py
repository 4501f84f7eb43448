"""Drives whose values have short pulses in time, or kinks in the state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from drawing.parts import Model, number, spread, within

from exudyn_flexlink.api.results import Result
from exudyn_flexlink.arrays import FloatArray
from silent.closed_forms import Bent, Term
from silent.scenes import Case, Rng, apart, asked, joint, rigid

Motion = Callable[[FloatArray], FloatArray]  # angle (rad) or way (m) (n,), at times (n,) s


@dataclass(frozen=True)
class Body:
    """A body that turns about O, or slides along the x-axis; its tip is watched."""

    turns: bool
    size: float  # kg, and kg m^2
    reach: float  # m, of the tip

    def driven(self, kind: str, value: Any, *start: float) -> Model:
        """A model of it: what drives it, and at which place and speed it starts."""
        at = {"point": "body.hub", "value": [value, 0]}
        drive = at if kind == "force" else {"joint": "way", "value": value}
        keys = ("angles", "speeds") if self.turns else ("along", "speeds_along")
        name = "body" if self.turns else "way"
        return {
            "bodies": {"body": rigid(self.size, self.size, tip=self.reach)},
            "joints": {"way": joint("ground", "body.hub", *(() if self.turns else (1, 0)))},
            "drives": {"drive": {"type": kind, **drive}},
            "initial": {key: {name: x} for key, x in zip(keys, start, strict=False)},
        }

    def off(self, motion: Motion, result: Result) -> float:
        """How far (m) its tip is off this motion."""
        moved = motion(result.time)
        angle, out = (moved, 0.0) if self.turns else (0.0 * moved, moved)
        return apart(result, out + self.reach * np.cos(angle), self.reach * np.sin(angle))


def pulses(rng: Rng) -> list[Case]:
    """One to four pulses of 1 us to 10 ms beside what moves much more, in a value of time.

    That of a force, a torque, a speed; of a force beside a spring in one formula; of the motion of
    a foot at the other end of a spring.
    """
    kinds = {"force": 0.3, "torque": 0.2, "speed": 0.3, "spring": 0.1, "foot": 0.1}
    kind = str(rng.choice(list(kinds), p=list(kinds.values())))
    turns = kind == "torque" or (kind == "speed" and rng.random() < 0.5)
    body = Body(turns, spread(rng, 0.1, 10), within(rng, 0.05, 0.5))
    order, sprung, end = 2 - (kind == "speed"), kind in ("spring", "foot"), within(rng, 0.2, 3)
    k = number(body.size * spread(rng, 3, 60) ** 2)
    w = np.sqrt(k / body.size)
    gain = {"speed": 1.0, "foot": w**2}.get(kind, 1 / body.size)
    redundant, tabled = rng.random() < 0.15, not sprung and rng.random() < 0.2
    last = asked(rng, "body.tip", end, 1e-6 if redundant else 1e-8)  # there it is but an aim

    def motion(terms: list[Term], time: FloatArray) -> FloatArray:
        each = (one.resonant(time, w) if sprung else one.integral(time, order) for one in terms)
        return np.asarray(gain * sum(each))

    def sized(shapes: list[str], at: float, wide: float, moved: float) -> Term:
        """Return a term that moves the tip so far (m)."""
        one = Term(str(rng.choice(shapes)), number(at), number(wide), rng.choice([-1.0, 1.0]))
        most = np.abs(motion([one], np.linspace(at, end, 60))).max()
        return one._replace(size=number(one.size * moved / most / (body.reach if turns else 1)))

    jumps = ["box", "steps"] if kind in ("force", "torque") else []
    shapes = ["gauss"] if sprung else ["hat"] if tabled else ["gauss", "hat", "plateau", *jumps]
    shortest, most = (1e-4, 1.5) if kind == "foot" else (1e-6, 3.0)
    few = [
        sized(shapes, end * rng.uniform(0.02, 0.98), spread(rng, shortest, 1e-2),
              last["accuracy"]["tolerance"] * 10 ** rng.uniform(-0.5, most))
        for _ in range(rng.choice([1, 1, 2, 4]))
    ]  # fmt: skip
    part, far = number(end * rng.uniform(0.02, 0.3)), 10 ** rng.uniform(-3, -1 if sprung else 1.5)
    if sprung or tabled or rng.random() < 0.4:
        large = sized(shapes[:1], end * rng.random(), part, far)
    elif jumps and rng.random() < 0.5:
        large = sized(["early"], part, part, far)
    else:
        large = sized(["wave", "decay", "level"], 0.0, part, far)
    terms = [large, *few]
    value = _table(terms, end) if tabled else _formula(large, few)
    if kind == "spring":
        value = f"{value}-{k}*place(way)"
    drive = {"spring": "force", "foot": "motion"}.get(kind, kind)
    model = {**body.driven(drive, value, *([0.0, 0.0] if sprung else [])), **last}
    if kind == "foot":
        model["bodies"]["foot"] = rigid(1, 1)
        model["joints"]["base"] = joint("ground", "foot.hub", 1, 0)
        model["drives"]["drive"]["joint"] = "base"
        hanger = {"type": "linear", "points": ["foot.hub", "body.hub"], "stiffness": k, "length": 0}
        model["springs"] = {"hanger": hanger}
    if redundant:
        model["solver"] = {"formulation": "redundant"}
    return [Case(model, partial(body.off, partial(motion, terms)))]


def _formula(large: Term, few: list[Term]) -> str:
    """Write a sum of terms: as a factor, from a switch on, or one after the other."""
    short, ends = "".join(one.text for one in few), large.at + large.wide
    if large.shape == "level":
        parts = (one._replace(size=one.size / large.size).text for one in few)
        return f"{large.size}*(1{''.join(parts)})"
    if large.shape == "early" and all(one.at > ends + 30 * one.wide for one in few):
        return f"where(t < {ends}, {large.size}, {short.lstrip('+')})"
    return (short + large.text).lstrip("+")


def _table(terms: list[Term], end: float) -> Model:
    """Write a sum of hats as rows of a table: it is straight between their corners."""
    corners = [one.at + side * one.wide for one in terms for side in (-1, 0, 1)]
    time = np.unique([0.0, *corners, end])
    high = sum(one.size * np.maximum(0, 1 - np.abs(time - one.at) / one.wide) for one in terms)
    return {"points": np.column_stack([time, high]).tolist(), "rule": "linear"}


def kinks(rng: Rng) -> list[Case]:
    """A force or a torque that bends with the state, with 10 to 300 bends passed, over three runs.

    What a bend costs jumps with the length of the run.
    """
    turns = bool(rng.random() < 0.4)
    body = Body(turns, spread(rng, 0.1, 5), within(rng, 0.05, 0.5))
    w, gap, end = spread(rng, 20, 600), spread(rng, 1e-3, 0.1), spread(rng, 0.2, 3)
    out = "angle(way)" if turns else str(rng.choice(["place(way)", "place(body.hub, x)"]))
    text, bent = _bent(rng, number(body.size * w**2), gap, out)
    start = number(gap * rng.uniform(-0.5, 0.5)), number(gap * w * spread(rng, 0.1, 3))

    def motion(time: FloatArray) -> FloatArray:
        return bent.swing(body.size, *start, time)[0]

    passed = bent.swing(body.size, *start, np.array([0.0, end]))[1]
    end *= min(1.0, spread(rng, 10, 300) / max(passed, 1))
    last = asked(rng, "body.tip", end)
    model = {**body.driven("torque" if turns else "force", text, *start), **last}
    lengths = ({"run": {"duration": number(end * part)}} for part in (1.0, 0.83, 0.61))
    return [Case({**model, **length}, partial(body.off, motion)) for length in lengths]


def _bent(rng: Rng, k: float, g: float, x: str) -> tuple[str, Bent]:
    """Draw a formula of what is out, x, and the law that it is; k is a stiffness, g a gap."""
    soft, far = number(k * rng.uniform(0.05, 0.9)), number(g * rng.uniform(0.3, 3))
    near, damper, v = number(g / 2), number(np.sqrt(k) * 0.05), "speed(way)"
    stops, zone = ((k, g, 1), (soft, -far, -1)), ((k, g, 1), (k, -g, -1))
    stairs = ((soft, near, 1), (k, g, 1), (k, -near, -1), (soft, -g, -1))
    forms = {
        f"-{k}*max(0, {x}-{g})+{soft}*max(0, -{far}-{x})": Bent(hinges=stops),
        f"{k}*min(0, {g}-{x})-{soft}*min(0, {x}+{far})": Bent(hinges=stops),
        f"-{soft}*{x}-{k}*max(0, {x}-{g})": Bent(soft, hinges=((k, g, 1),)),
        f"-{k}*({x}-max(-{g}, min({g}, {x})))": Bent(hinges=zone),
        f"-{k}*({x}-(abs({x}+{g})-abs({x}-{g}))/2)": Bent(hinges=zone),
        f"-{k}*max(-{g}, min({g}, {x}))": Bent(k, hinges=((-k, g, 1), (-k, -g, -1))),
        f"-{k}*{x}-{soft}*abs({x}-{g})": Bent(k + soft, soft * g, ((-2 * soft, g, -1),)),
        f"-{soft}*max(0, {x}-{near})-{k}*max(0, {x}-{g})"
        f"+{k}*max(0, -{near}-{x})+{soft}*max(0, -{g}-{x})": Bent(hinges=stairs),
        f"-{k}*{x}-{damper}*max(0, {v})": Bent(k, damper=damper),
        f"-{k}*{x}-{damper}*({v}+abs({v}))/2-{k}*max(0, {x}-{g})": Bent(k, 0.0, zone[:1], damper),
    }
    return list(forms.items())[rng.integers(len(forms))]
