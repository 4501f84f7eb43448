"""What the program says of strikes, and of the bodies that are struck."""

from __future__ import annotations

from itertools import pairwise
from math import degrees, inf, isfinite

from exudyn_flexlink.observables import Strike, crank_joint, lever_response, strikes, struck_bodies
from exudyn_flexlink.report.tables import Column, Table, table_of_items
from exudyn_flexlink.result import Result

BESIDES = ("lasts", "touches", "impulse", "energy lost", "peak force")
"""Columns that have no room in a terminal."""


def strike_table(result: Result, contact: str, most: int) -> Table:
    """Return the first `most` strikes of a contact, and how far what is struck goes after each.

    Empty cells: what a strike that still lasts passes on in all, and the force of an impulse.
    """
    found = strikes(result, contact)
    struck = result.scene.contacts[contact].struck
    columns: dict[str, Column[Strike]] = {}
    if found and found[0].lap is not None:
        columns["lap"] = "", lambda strike: str(strike.lap)
    if found and found[0].crank_angle is not None:
        columns[f"angle of {crank_joint(result.scene)}"] = (
            "deg",
            lambda strike: f"{degrees(strike.crank_angle or 0.0) % 360:.2f}",
        )
    columns |= {
        "time": ("s", lambda strike: f"{strike.begin:.5f}"),
        "approach": ("m/s", lambda strike: f"{strike.approach_speed:.4f}"),
        "place": ("m", lambda strike: f"{strike.place:.5f}"),
    }
    if struck is not None:
        response = lever_response(result, contact)
        begins = [*(strike.begin for strike in found), inf]
        until = dict(pairwise(begins))  # the next strike
        columns[f"{struck} peak"] = (
            response.measure.unit,
            lambda strike: response.measure.number(
                response.between(strike.begin, until[strike.begin]).farthest
            ),
        )
    columns |= {
        "lasts": ("s", lambda strike: f"{strike.end - strike.begin:.5f}"),
        "touches": ("", lambda strike: str(strike.contacts)),
        "impulse": ("N s", lambda strike: _known(strike.impulse)),
        "energy lost": ("J", lambda strike: _known(strike.energy_lost)),
        "peak force": ("N", lambda strike: _known(strike.peak_force)),
    }
    return table_of_items(f"Strikes of contact '{contact}'", columns, found[:most], len(found))


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


def _known(value: float) -> str:
    return f"{value:.4g}" if isfinite(value) else ""
