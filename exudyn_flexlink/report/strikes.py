"""What the program says of strikes, and of the bodies that are struck."""

from __future__ import annotations

from math import degrees, inf, isfinite

from exudyn_flexlink.observables import (
    LeverResponse,
    Strike,
    crank_joint,
    lever_response,
    strikes,
    struck_bodies,
)
from exudyn_flexlink.report.tables import Table, left_out
from exudyn_flexlink.result import Result

BESIDES = ("lasts", "touches", "impulse", "energy lost", "peak force")
"""Columns that have no room in a terminal."""


def strike_table(result: Result, contact: str, most: int) -> Table:
    """Return the first `most` strikes of a contact, and how far what is struck goes after each.

    Empty cells: what a strike that still lasts passes on in all, and the force of an impulse.
    """
    found = strikes(result, contact)
    struck = result.scene.contacts[contact].struck
    response = None if struck is None else lever_response(result, contact)
    turned = {}
    if found and found[0].lap is not None:
        turned["lap"] = ""
    if found and found[0].crank_angle is not None:
        turned[f"angle of {crank_joint(result.scene)}"] = "deg"
    peak = {} if response is None else {f"{struck} peak": response.measure.unit}
    common = {"time": "s", "approach": "m/s", "place": "m"}
    passed = {"lasts": "s", "touches": "", "impulse": "N s", "energy lost": "J", "peak force": "N"}
    columns = {**turned, **common, **peak, **passed}
    ends = [*(strike.begin for strike in found[1:]), inf][: len(found)]
    rows = [
        [
            *_turned(strike),
            *_first_touch(strike),
            *([_peak(response, strike, end)] if response is not None else []),
            *_passed(strike),
        ]
        for strike, end in list(zip(found, ends, strict=True))[:most]
    ]
    return Table(
        f"Strikes of contact '{contact}'",
        rows,
        list(columns),
        list(columns.values()),
        left_out(len(found), most),
    )


def response_table(result: Result) -> Table:
    """Return how far every struck body goes at least and at most, from where it is at time 0."""
    rows = []
    for body, contact in struck_bodies(result.scene).items():
        response = lever_response(result, contact)
        (low, _), (high, _) = response.least, response.greatest
        measure = response.measure
        reach = f"from {measure.number(low)} to {measure.told(high)}"
        rows.append([body, f"{measure.word} {reach}"])
    return Table("Motion of struck bodies", rows)


def _turned(strike: Strike) -> list[str]:
    """Lap and angle of the joint whose turns count, as far as there are any."""
    lap, angle = strike.lap, strike.crank_angle
    told = [] if lap is None else [str(lap)]
    return [*told, *([] if angle is None else [f"{degrees(angle) % 360:.2f}"])]


def _first_touch(strike: Strike) -> list[str]:
    return [f"{strike.begin:.5f}", f"{strike.approach_speed:.4f}", f"{strike.place:.5f}"]


def _peak(response: LeverResponse, strike: Strike, until: float) -> str:
    """Where what is struck is farthest from where it was, before the next strike (s)."""
    return response.measure.number(response.between(strike.begin, until).farthest)


def _passed(strike: Strike) -> list[str]:
    numbers = (strike.impulse, strike.energy_lost, strike.peak_force)
    told = [f"{value:.4g}" if isfinite(value) else "" for value in numbers]
    return [f"{strike.end - strike.begin:.5f}", str(strike.contacts), *told]
