"""Figures of a run for a page: as text that an image takes for its file, and in words."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass, replace

from matplotlib.figure import Figure

from exudyn_flexlink.observables import (
    force_peaks,
    forces_of,
    lever_response,
    sleeves_with_play,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.plots import PRINT, SCREEN, figure_bytes, figures
from exudyn_flexlink.report import listed
from exudyn_flexlink.result import Extremes, Result

WIDE = replace(SCREEN, titled=False)  # the page says what stands in a title
NARROW = PRINT  # a column of print, 86 mm, is about as wide as a phone
PIXELS = 96  # of a page in an inch
MOST_SVG = 250_000  # bytes: beyond, lines are so many that pixels take less room
COORDINATES = re.compile(rb' (?:d|x|y)="[^"]*"')
DECIMALS = re.compile(rb"(\.\d\d)\d+")  # more than a hundredth of a point nobody sees


@dataclass(frozen=True)
class Picture:
    """A figure with its caption and what it shows in words.

    `wide` and `narrow` are data URIs; `size` is that of the wide one, in pixels of a page.
    """

    name: str
    caption: str
    alt: str
    wide: str
    narrow: str
    size: tuple[int, int]


def pictures_of(result: Result) -> dict[str, Picture]:
    """Return every figure that makes sense for a run, by name."""
    wide, narrow = figures(result, WIDE), figures(result, NARROW)
    return {
        name: Picture(
            name,
            str(figure.get_label()),
            described(result, name),
            _uri(figure),
            _uri(narrow[name]),
            (round(PIXELS * figure.get_figwidth()), round(PIXELS * figure.get_figheight())),
        )
        for name, figure in wide.items()
    }


def _uri(figure: Figure) -> str:
    """Return a figure as a data URI: lines, which stay sharp, unless they take too much room."""
    svg = COORDINATES.sub(lambda own: DECIMALS.sub(rb"\1", own[0]), figure_bytes(figure, "svg"))
    if len(svg) <= MOST_SVG:
        return data_uri("image/svg+xml", svg)
    return data_uri("image/png", figure_bytes(figure, "png"))


def data_uri(kind: str, content: bytes) -> str:
    """Return the content of a file of a kind as what a page takes for its address."""
    return f"data:{kind};base64,{b64encode(content).decode('ascii')}"


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
