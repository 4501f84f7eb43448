"""What figures show, in words, for readers who do not see them."""

from __future__ import annotations

from collections.abc import Callable

from exudyn_flexlink.observables import (
    force_peaks,
    forces_of,
    lever_response,
    sleeves_with_play,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.report import listed
from exudyn_flexlink.result import Extremes, Result


def described(result: Result, figure: str) -> str:
    """Return what a figure of `plots` shows of a run: what is drawn, and its extremes."""
    return _DESCRIPTIONS[figure](result)


def _coordinates(result: Result) -> str:
    point = watched_point(result.scene)
    ranges = (f"{axis} {_range(result.extremes[f'{point}.{axis}_m'], 'm')}" for axis in "xy")
    return f"Lines of both coordinates of {point}: {', '.join(ranges)}."


def _polar(result: Result) -> str:
    point = watched_point(result.scene)
    distance = _range(result.extremes[f"{point}.distance_m"], "m")
    return f"Polar diagram of the distance of {point} from the origin, {distance}."


def _lever(result: Result) -> str:
    told = []
    for body, contact in struck_bodies(result.scene).items():
        response = lever_response(result, contact)
        (low, at), (high, then) = response.least, response.greatest
        word, unit = response.measure.word, response.measure.unit
        told.append(
            f"{word} of {body} {low:.4g} {unit} at {at:.4g} s, {high:.4g} {unit} at {then:.4g} s"
        )
    return f"Lines over time, least and greatest: {'; '.join(told)}."


def _mechanism(result: Result) -> str:
    scene = result.scene
    curves = f"; curves {listed(list(scene.curves))}" if scene.curves else ""
    return f"Drawings at some instants: bodies {listed(list(scene.bodies))}{curves}."


def _guide(result: Result) -> str:
    joints = listed(sleeves_with_play(result))
    return f"Drawings of the link between the walls of its guide, and when it touches: {joints}."


def _energy(result: Result) -> str:
    checks = result.checks
    return (
        f"Lines of the energies over time, the kinetic one {checks.largest_kinetic_energy:.4g} J "
        f"at most, and of what their balance misses, {checks.energy_residual:.2g} J at most."
    )


def _forces(result: Result) -> str:
    peaks = force_peaks(result)
    told = [f"{name} {peak.value:.4g} {peak.unit}" for name, peak in peaks.items()]
    unbound = [name for name in forces_of(result) if name not in peaks]
    return f"Lines over the run, with the largest of each: {', '.join([*told, *unbound])}."


def _range(own: Extremes, unit: str) -> str:
    return f"from {own.least[0]:.4g} to {own.greatest[0]:.4g} {unit}"


_DESCRIPTIONS: dict[str, Callable[[Result], str]] = {
    "coordinates": _coordinates,
    "polar": _polar,
    "lever": _lever,
    "mechanism": _mechanism,
    "guide_contact": _guide,
    "energy": _energy,
    "forces": _forces,
}
