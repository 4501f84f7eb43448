"""Quantities of a run by name, such as 'lever.angle', as columns of measurements have them.

Also vibrations of points: their distance from the ideal mechanism's, and its spectrum.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from math import inf, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import anchor_position, build_mechanism
from exudyn_flexlink.observables.instants import between_samples, straight_between
from exudyn_flexlink.observables.levers import ANGLE, lever_response, measures, struck_bodies
from exudyn_flexlink.observables.parting import common_times
from exudyn_flexlink.observables.points import (
    body_motion,
    path,
    point_anchor,
    point_names,
    watched_point,
)
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.result import Result
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import FlexibleBody, RodBody, Scene, SleeveJoint, split_point
from exudyn_flexlink.source import did_you_mean, listed

_UNITS = {Dimension.LENGTH: "m", Dimension.ANGLE: "rad", Dimension.ANGULAR_SPEED: "rad/s"}


@dataclass(frozen=True)
class Signal:
    """A quantity of a scene's runs: its values (N,) in SI at samples, and their rates if known."""

    name: str
    dimension: Dimension
    samples: Callable[[Result], tuple[FloatArray, FloatArray | None]]

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return _UNITS[self.dimension]

    def at(self, run: Result, time: FloatArray) -> FloatArray:
        """Values (M,) at instants (M,) s within a run."""
        values, rates = self.samples(run)
        if rates is None:
            return straight_between(run.time, values, time)
        return between_samples(run.time, values, rates, time)


def signals(scene: Scene) -> dict[str, Signal]:
    """Return all quantities of a scene's runs, by name.

    ``BODY.angle`` (from +x of the ground, as `initial.angles` counts it; of a flexible body that of
    its first rod), ``BODY.rate``, ``BODY.POINT.x`` and ``.y``; of a struck body ``BODY.response``,
    its angle or displacement from the start on, as its own table has it.
    """
    quantities, by_body = list[Signal](), measures(scene)
    for body in scene.bodies:
        quantities.append(Signal(f"{body}.angle", Dimension.ANGLE, partial(_angle, body)))
        quantities.append(Signal(f"{body}.rate", Dimension.ANGULAR_SPEED, partial(_rate, body)))
    for point in point_names(scene):
        for i, axis in enumerate("xy"):
            quantities.append(
                Signal(f"{point}.{axis}", Dimension.LENGTH, partial(_place, point, i))
            )
    for body, contact in struck_bodies(scene).items():
        kind = Dimension.ANGLE if by_body[body] is ANGLE else Dimension.LENGTH
        quantities.append(Signal(f"{body}.response", kind, partial(_response, contact)))
    return {signal.name: signal for signal in quantities}


def _angle(body: str, run: Result) -> tuple[FloatArray, FloatArray]:
    motion = body_motion(run, body)
    return motion.angle, motion.rate


def _rate(body: str, run: Result) -> tuple[FloatArray, None]:
    return body_motion(run, body).rate, None


def _place(point: str, axis: int, run: Result) -> tuple[FloatArray, FloatArray]:
    place = path(run, point)
    return place.position[:, axis], place.velocity[:, axis]


def _response(contact: str, run: Result) -> tuple[FloatArray, FloatArray]:
    response = lever_response(run, contact)
    return response.value, response.rate


def table_columns(scene: Scene) -> dict[str, str]:
    """Names of quantities by those that columns have in the tables of a run, without units."""
    watched, by_body = watched_point(scene), measures(scene)
    columns = {axis: f"{watched}.{axis}" for axis in "xy"}
    if len(by_body) == 1:  # tables of several struck bodies share names of columns
        columns |= {measure.word: f"{body}.response" for body, measure in by_body.items()}
    return columns


def unknown_signal(name: str, known: Iterable[str]) -> str:
    """Message that no quantity has this name, with the known names."""
    names = list(known)
    near = did_you_mean(name, names) or f"; there are: {listed(names)}"
    return f"the scene has no quantity '{name}'{near}"


SEGMENT = 0.5  # of the record: length of the spectrum's segments, which overlap by half
MOST_LINES = 3
WEAK = 0.01  # of the strongest line's power: weaker lines are left out
GRID = 8  # trial frequencies in each interval of 1 / T: a peak is 4 / T wide
FEWEST = 32  # samples of a spectrum


@dataclass(frozen=True)
class Spectrum:
    """Power by frequency: `frequency` (K,) Hz, `power` (K,) unit^2/Hz, by Welch's method.

    `lines` (Hz) are its highest peaks, strongest first, accurate to half of `resolution` (Hz). All
    are empty if the record is too short, or constant.
    """

    frequency: FloatArray
    power: FloatArray
    lines: tuple[float, ...]
    resolution: float


def spectrum(time: FloatArray, values: FloatArray) -> Spectrum:
    """Spectrum of values (N,) at even instants (N,) s; the last, the run's end, may be uneven."""
    # the import of scipy takes a second, and `check` should not wait for it
    from scipy.signal import find_peaks, welch  # noqa: PLC0415

    count = max(1, int(SEGMENT * len(time)))
    resolution = float(1 / (count * (time[1] - time[0]))) if len(time) > 1 else inf
    values = values[:-1]
    if len(values) < FEWEST or not np.ptp(values):
        return Spectrum(np.zeros(0), np.zeros(0), (), resolution)
    count = int(SEGMENT * len(values))
    frequencies, power = welch(values, 1 / (time[1] - time[0]), nperseg=count)
    peaks, _ = find_peaks(power, height=WEAK * power.max())
    strongest = peaks[np.argsort(power[peaks])[::-1][:MOST_LINES]]
    return Spectrum(frequencies, power, tuple(frequencies[strongest].tolist()), resolution)


def strongest_line(time: FloatArray, signal: FloatArray, lowest: float, highest: float) -> float:
    """Angular frequency (rad/s) between two at which a record has its strongest line.

    `time` (N,) s is even. Hann's window keeps other lines away: at a distance of k / T, for a
    record of T seconds, they count by 1 / k^3.
    """
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - see `spectrum`

    shape = (signal - signal.mean()) * np.hanning(len(signal))

    def strength(omega: float) -> float:
        return float(np.abs(np.exp(-1j * omega * time) @ shape))

    length = float(time[-1] - time[0])
    trial = np.linspace(lowest, highest, 2 + int(GRID * (highest - lowest) * length / (2 * pi)))
    best, width = max(trial, key=strength), float(trial[1] - trial[0])
    beside = np.clip([best - width, best + width], lowest, highest)
    options = {"xatol": NEGLIGIBLE * best}
    return float(minimize_scalar(lambda omega: -strength(omega), bounds=beside, options=options).x)


@dataclass(frozen=True)
class Vibration:
    """Spectra (m^2/Hz) of `moved` (N, 2) m, the watched point's motion along x and y.

    With `off_ideal` it is the distance of the point from its place on a straight link on its
    guide's axis (see `perturbation`); otherwise, without such a place, it is the point's place.
    """

    moved: FloatArray
    x: Spectrum
    y: Spectrum
    off_ideal: bool

    @property
    def rms(self) -> FloatArray:
        """Roots of the mean squares (2,) of x and y, m."""
        return np.asarray(np.sqrt(np.mean(self.moved**2, axis=0)))

    @property
    def peak(self) -> FloatArray:
        """Largest absolute values (2,) of x and y, m."""
        return np.asarray(np.abs(self.moved).max(axis=0))


def vibration(result: Result, after: float = 0.0) -> Vibration:
    """Vibration of the watched point from `after` (s) on.

    Raises:
        ValueError: the run has ended by then.

    """
    if after > result.time[-1]:
        raise ValueError(
            f"nothing vibrates after {after:.9g} s: the run ends at {result.time[-1]:.9g} s"
        )
    point, time = watched_point(result.scene), common_times(result, result)
    time = time[time >= after]
    off = perturbation(result, point, time)
    moved = path(result, point).at(time) if off is None else off
    x, y = (spectrum(time, column) for column in moved.T)
    return Vibration(moved, x, y, off is not None)


def perturbation(result: Result, point: str, time: FloatArray) -> FloatArray | None:
    """Distance (N, 2) m of 'body.point', in x and y, from its ideal place at instants (N,) s.

    The ideal place is on a straight link on the axis of its guide, see `on_axis`; None without it.
    """
    ideal = on_axis(result, point)
    if ideal is None:
        return None
    return straight_between(result.time, path(result, point).position - ideal, time)


def on_axis(result: Result, point: str) -> FloatArray | None:
    """Place (N, 2), m, of a link's end on an ideal link: straight, on the axis of its guide.

    The start of the ideal link has the same place along the guide, but lies on the axis. None if
    the point is not the end of a link in a guide.
    """
    body, inner = split_point(point)
    scene = result.scene
    spec = scene.bodies.get(body)
    joints = [
        name
        for name, joint in scene.joints.items()
        if isinstance(joint, SleeveJoint) and joint.link == body
    ]
    if not joints or inner != "end" or not isinstance(spec, (RodBody, FlexibleBody)):
        return None
    mechanism = build_mechanism(scene)
    # The x-axis of this anchor is the axis of the guide.
    guides = {slide.name: slide.first for slide in mechanism.slides}
    guide = (guides | {channel.name: channel.guide for channel in mechanism.channels})[joints[0]]
    start = anchor_position(point_anchor(scene, mechanism, f"{body}.start"), result.poses)
    origin, angle = anchor_position(guide, result.poses), result.poses[:, guide.part, 2]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    reach = np.sum((start - origin) * along, axis=-1) + spec.length
    return np.asarray(origin + reach[:, None] * along)
