"""Random touches that are short, or many, against closed forms: none may be missed silently.

Usage:
  .venv/bin/python scripts/random_touches.py --number 40 --seed 7 --jobs 2 throw hops
  .venv/bin/python scripts/random_touches.py --only 12 throw   its model file, told in full

A ball is thrown past a pin, hops past it, rattles about it in a box, flies over a hill, does so on
a slide (cart), meets a lobe of a free cam; a part passes a spring's click, or is turned back; the
force of a strike is told. Exit code 1: over before that is told, or told in three strikes of a pin.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal, getcontext
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from benchmarks import verdicts
from benchmarks.side_by_side import add_numbers, judged, numbers_of
from benchmarks.verdicts import RIGHT, SILENT, STOPPED, TOLD, Verdict
from drawing.parts import spread, within
from random_strikes import forces
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import ComplexArray, FloatArray

EARLY, AFTER, CRASHED = "told early", "told late", verdicts.CRASHED
ENDS = RIGHT, TOLD, STOPPED, verdicts.REFUSED, verdicts.LATE, EARLY, AFTER, SILENT, CRASHED
PATIENCE = 120.0  # s of processor time
MOST = {"billiard": 12, "strike": 40}  # scenes, of which each takes long
MOST_STRIKES = 12  # that take energy: what strikes more often is about to come to rest
LONGEST, SHALLOW = Decimal("0.1"), Decimal("1e-3")  # s: a step; part of the speed: a graze
Rng = np.random.Generator
Hit = tuple[Callable[[Any], Any], str, str]  # by x, y and a cam's angle: gap, slopes; curve; side
Drawn = tuple[str, Any, float]  # model file, ways of the part's tip by instants, quiet until (s)
getcontext().prec = 60  # digits: in a billiard errors grow tenfold from strike to strike
exact = np.vectorize(lambda value: Decimal(float(value)), otypes=[object])
HEAD = "title: a\nrun: {{duration: {}}}\naccuracy: {{tolerance: {}}}\nbodies: {{{}}}\n"
HEAD += "joints: {{{}}}\ninitial: {{{}}}\noutputs: {{watch: part.tip}}\n"
RIGID = "{}: {{type: rigid, mass: {}, inertia: {}, points: {{c: [0, 0], tip: [0.3, 0]}}}}, "
SLIDE = "way: {{type: prismatic, points: [ground, part.c], at: [0, {}], axis: [1, 0]}}, "
TURN = "turn: {{type: revolute, points: [ground, {}.c], at: [0, 0]}}"


class GrazeError(Exception):
    """A draw that touches, or not, by less than can be told, or strikes too often."""


def _pair(place: complex) -> list[float]:
    return [float(place.real), float(place.imag)]


def _line(begin: complex, end: complex, radius: float) -> Hit:
    normal = 1j * (end - begin) / abs(end - begin)
    across, far = exact([*_pair(normal), 0]), (begin * normal.conjugate()).real + radius
    curve = f"line, from: {_pair(begin)}, to: {_pair(end)}"
    return lambda q: (across @ q - Decimal(far), across), curve, "left"


def _circle(middle: complex, other: float, radius: float) -> Hit:
    def gap(q: Any) -> Any:
        away = exact([1, 1, 0]) * q - exact([*_pair(middle), 0])
        far = (away @ away).sqrt()
        return far - Decimal(other) - Decimal(radius), away / far

    return gap, f"circle, centre: {_pair(middle)}, radius: {other}", "right"


def _spline(points: ComplexArray, radius: float, cam: bool) -> Hit:
    row = np.append(points, points[:1]) if cam else points
    chords = np.append(0, np.cumsum(np.abs(np.diff(row))))
    curve = CubicSpline(chords, row, bc_type="periodic" if cam else "not-a-knot")
    along = np.interp(np.arange(0, len(chords) - 1, 0.02), np.arange(len(chords)), chords)
    seen, across = curve(along), -1j if cam else 1j

    def gap(q: Any) -> Any:
        place = complex(*map(float, q[:2])) / (turned := np.exp(1j * float(q[2])))
        u = along[np.argmin(abs(place - seen))]
        for _ in range(5):  # the foot, by Newton's method
            away, ahead, bend = place - curve(u), curve(u, 1), curve(u, 2)
            u -= (away * ahead.conj()).real / ((away * bend.conj()).real - abs(ahead) ** 2)
        normal = across * ahead / abs(ahead)
        slopes = [*_pair(normal * turned), (normal.conj() * -1j * place).real]
        return Decimal(float(((place - curve(u)) * normal.conj()).real - radius)), exact(slopes)

    text = f"spline, points: {[_pair(point) for point in points]}, closed: {str(cam).lower()}"
    return gap, text + ", on: cam" * cam, "right" if cam else "left"


class Ball(NamedTuple):
    """A ball of 1 kg; strikes give `back` speed; `cam`: reach, angle, speed, inertia of one."""

    place: complex
    speed: complex
    hits: list[Hit]
    end: float
    radius: float
    back: float = 1.0
    gravity: float = 0.0
    slides: bool = False
    cam: tuple[float, ...] = (0.0, 0.0, 0.0, np.inf)

    def flown(self, near: float = 1e-9) -> tuple[Any, list[float]]:
        """Return its places by instants, and the instants (s) at which the first of `hits` is."""
        # What nears no faster than a rate can't touch before gap / rate: no touch is missed.
        (reach, angle, spin, inertia), tight, t = self.cam, Decimal(near), Decimal(0)
        state = [*_pair(self.place), angle], [*_pair(self.speed), spin], [0, -self.gravity / 2, 0]
        flights, begins, struck, ways = [exact(state)], [Decimal(0)], [], exact([1, 1, reach])
        gaps, yields = [gap for gap, *_ in self.hits], exact([1, not self.slides, 1 / inertia])
        if min(gap(flights[0][0])[0] for gap in gaps) < tight:
            raise GrazeError
        while begins[-1] + t < self.end:
            place, speed, half = flights[-1]
            now = speed + 2 * half * t
            looks = [(*gap(place + (speed + half * t) * t), gap) for gap in gaps]
            away, slope, gap = min(looks, key=lambda look: look[0])
            if away > tight or slope @ now >= 0:
                fastest = ways @ (abs(now) + 2 * abs(half) * LONGEST)
                t += min(max(away, tight) / fastest, LONGEST)
                continue
            for _ in range(12):  # Newton's method: each step doubles the digits
                t -= away / (slope @ (speed + 2 * half * t))
                away, slope = gap(place + (speed + half * t) * t)
            place, speed = place + (speed + half * t) * t, speed + 2 * half * t
            often = self.back < 1 and len(struck) == MOST_STRIKES
            if often or abs(away) > 1e-14 or slope @ speed > -SHALLOW * (ways @ abs(speed)):
                raise GrazeError
            pushed = slope * yields / (slope @ (slope * yields))
            speed = speed - (1 + Decimal(self.back)) * (slope @ speed) * pushed
            flights.append(np.array([place, speed, half]))
            begins, struck, t = [*begins, begins[-1] + t], [*struck, gap], Decimal(0)
        since, motions = np.array(begins, dtype=float), np.array(flights, dtype=float) @ (1, 1j, 0)

        def places(time: FloatArray) -> ComplexArray:
            last = np.searchsorted(since[1:], time, side="right")
            (place, speed, half), t = motions[last].T, time - since[last]
            return np.asarray(place + (speed + half * t) * t)

        return places, [t for t, gap in zip(since[1:], struck, strict=True) if gap is gaps[0]]

    def drawn(self, rng: Rng) -> Drawn:
        """Fly it, and write it as a model file."""
        places, pins = self.flown(near := spread(rng, 1e-8, 1e-5))
        (x, y), (vx, vy), (reach, angle, spin, inertia) = *map(_pair, self[:2]), self.cam
        curves = contacts = ""
        for k, (_, curve, side) in enumerate(self.hits):
            size, fixed = f"radius: {self.radius}", curve.partition("centre: ")[2]
            on = f"point_on_curve, point: part.c, {size}, curve: c{k}, side: {side}"
            if fixed and rng.random() < 0.5:
                other = f"{{at: ground, place: {fixed}}}"
                on = f"circle_on_circle, circles: [{{at: part.c, {size}}}, {other}]"
            curves += f"c{k}: {{type: {curve}}}, "
            contacts += f"h{k}: {{type: {on}, law: {{type: impulse, restitution: {self.back}}}}}, "
        bodies = RIGID.format("part", 1, 1) + RIGID.format("cam", 1, inertia) * (reach > 0)
        joints = SLIDE.format(y) * self.slides + TURN.format("cam") * (reach > 0)
        initial = f"positions: {{part: [{x}, {y}]}}, velocities: {{part: [{vx}, {vy}]}}"
        if self.slides:
            initial = f"along: {{way: {x}}}, speeds_along: {{way: {vx}}}"
        initial += f", angles: {{cam: {angle}}}, speeds: {{cam: {spin}}}" * (reach > 0)
        model = HEAD.format(self.end, near, bodies, joints, initial)
        model += f"curves: {{{curves}}}\ncontacts: {{{contacts}}}\ngravity: [0, -{self.gravity}]"
        return model, places, max(pins[2:3], default=0.0)


def _beside(rng: Rng, ahead: complex) -> complex:  # 1 is a touch: all but, or just
    off = 1 + rng.choice([1, -1]) * spread(rng, 1e-4, 0.9)
    return complex(1j * ahead / abs(ahead) * rng.choice([1, -1]) * off)


def _throw(rng: Rng, slides: bool = False) -> Drawn:
    gravity, end = 9.81 * float(not slides and rng.random() < 0.8), spread(rng, 0.05, 10)
    radius, other = spread(rng, 1e-6, 0.3), spread(rng, 1e-6, 0.3)
    since, angle = within(rng, 0.05, 0.95) * end, 0.0 if slides else within(rng, -3, 3)
    speed = spread(rng, 0.3, 30) * np.exp(1j * angle)
    place = (radius + other) * _beside(rng, speed) - since * (speed + 0.5j * gravity * since)
    speed, back = speed + 1j * gravity * since, float(rng.choice([1, within(rng, 0.2, 1)]))
    rest = end, radius, back, gravity, slides
    return Ball(place, speed, [_circle(0j, other, radius)], *rest).drawn(rng)


def _hops(rng: Rng) -> Drawn:
    radius, other, end = spread(rng, 0.003, 0.2), spread(rng, 0.003, 0.2), spread(rng, 1, 10)
    place, speed = 1j * (radius + spread(rng, 0.05, 2)), complex(*rng.uniform(-3, 3, 2))
    back, floor = float(rng.choice([1, within(rng, 0.6, 1)])), _line(-100, 100, radius)
    ball = Ball(place, speed, [floor], end, radius, back, 9.81)
    at, ahead = ball.flown()[0](within(rng, 0.05, 0.95) * end + np.array([0, 1e-6]))
    middle = at + (radius + other) * _beside(rng, ahead - at)
    return ball._replace(hits=[_circle(middle, other, radius), floor]).drawn(rng)


def _billiard(rng: Rng) -> Drawn:
    radius, middle = within(rng, 0.03, 0.1), complex(*rng.uniform(-0.15, 0.15, 2))
    place, way = complex(*rng.uniform(radius - 0.5, 0.5 - radius, 2)), within(rng, -3, 3)
    corners = 0.5 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j, -1 - 1j])
    hits = [_circle(middle, within(rng, 0.08, 0.2), radius)]
    hits += [_line(*corners[k : k + 2], radius) for k in range(4)]
    return Ball(place, np.exp(1j * way), hits, 20.0, radius).drawn(rng)


def _bumped(rng: Rng, cam: bool = False, slides: bool = False) -> Drawn:
    width, size = spread(rng, 0.005, 0.3), spread(rng, 0.02, 0.2) if cam else 1.0
    radius = float(rng.choice([0, width * size * spread(rng, 0.01, 0.5)]))
    out = 3 * width * 1.5 ** np.arange(np.log(0.8 / width) / np.log(1.5))[1:]  # to 2.4
    along = np.concatenate([-out[::-1], width * np.linspace(-3, 3, 13), out])
    bump = width * spread(rng, 0.3, 2) * np.exp(-((along / width) ** 2))
    high, back = bump.max() * abs(_beside(rng, 1)), float(rng.choice([1, within(rng, 0.2, 1)]))
    speed, before = float(rng.choice([1, -1])) * spread(rng, 0.5, 20), within(rng, 0.1, 1)
    turn, end = rng.choice([-1, 0, 0, 1]) * spread(rng, 1e-3, 0.2), before + within(rng, 0.2, 1)
    ahead, beside = speed * np.exp(0j if slides else 1j * turn), (0.0, 0.0, 0.0, np.inf)
    place, points = 1j * (high + radius) - before * ahead / abs(speed), [-3, *along + 1j * bump, 3]
    if cam:
        place, points = size * (1 + high) + radius + 0j, size * (1 + bump) * np.exp(1j * along)
        inertia, ahead, end = size**2 * spread(rng, 0.1, 100), 0j, 6 * end
        beside = float(abs(points).max()), -6 * before * np.sign(speed), speed, inertia
    rest = end / abs(speed), radius, back, 0.0, slides, beside
    return Ball(place, ahead, [_spline(np.array(points), radius, cam)], *rest).drawn(rng)


def _click(rng: Rng, on: tuple[str, ...]) -> Drawn:
    joint, spring, u, initial = on
    middle, speed, mass = spread(rng, 0.1, 3), spread(rng, 0.1, 10), spread(rng, 0.1, 10)
    width, part = middle * spread(rng, 1e-3, 0.1), spread(rng, 0.02, 3)
    if 0.98 < part < 1.02:
        raise GrazeError  # it all but stands on the top
    high = float(mass * speed**2 / 2 * part * rng.choice([1, -1], p=[0.75, 0.25]))  # J
    forces = "-2*{u}*exp(-{u}**2)", "exp(-{u}**2)/sqrt(pi)", "sin({u})/2"  # times high / width
    force = f"{high / width!r}*{rng.choice(forces, p=[0.5, 0.4, 0.1])}"
    code, end = compile(force.format(u="u"), "", "eval"), middle / speed * within(rng, 1.2, 3)
    rates = lambda _, y: [y[1], -eval(code, vars(np), {"u": (y[0] - middle) / width}) / mass]  # noqa: E731
    steps = {"rtol": 1e-13, "atol": 1e-15, "max_step": width / speed / (1 + part) ** 0.5}
    run = solve_ivp(rates, (0, end), [0, speed], "DOP853", dense_output=True, **steps).sol
    ways = lambda t: 0.3 * np.exp(1j * run(t)[0]) - 0.3 if on is ABOUT else run(t)[0]  # noqa: E731
    near, body = spread(rng, 1e-8, 1e-5), RIGID.format("part", mass, mass)
    model = HEAD.format(end, near, body, joint, f"{initial}: {speed}}}")
    force = force.format(u=f"(({u}-{middle})/{width!r})")
    return f'{model}springs: {{click: {{type: {spring}: "{force}"}}}}', ways, 0.0


ALONG = SLIDE.format(0), "linear, joint: way, force", "length", "speeds_along: {way"
ABOUT = TURN.format("part"), "torsional, joint: turn, torque", "angle", "speeds: {part"
KINDS: dict[str, Callable[[Rng], Drawn]] = {
    "throw": _throw, "hops": _hops, "hill": _bumped, "billiard": _billiard,
    "cart": lambda rng: (_throw, _bumped)[rng.integers(2)](rng, slides=True),
    "free_cam": lambda rng: _bumped(rng, cam=True, slides=bool(rng.integers(2))),
    "click_slide": partial(_click, on=ALONG), "click_hinge": partial(_click, on=ABOUT),
}  # fmt: skip


def judge(pair: tuple[str, int], seed: int, measure: bool = True, shown: bool = False) -> Verdict:
    """Draw a scene by its kind and number, again if it is a graze; hold it against its place."""
    kind, number = pair
    rng, drawn = np.random.default_rng([seed, number, *kind.encode()]), None
    if kind == "strike":
        return verdicts.of_file("", kind, PATIENCE, lambda _: forces(rng, kind))
    while drawn is None:
        with suppress(GrazeError):
            drawn = KINDS[kind](rng)
    model, ways, quiet = drawn
    print(model * shown, end="")

    def verdict(path: Any) -> Verdict:
        result = simulate(load_scene(path), measure=measure)
        away = np.abs(result.path("part.tip").position @ (1, 1j) - 0.3 - ways(result.time))
        off, said = away / result.scene.accuracy.tolerance, result.warnings
        doubted = any(word in line for line in said for word in verdicts.OF_ACCURACY)
        told = result.error.exceeds_from or (0.0 if doubted else np.inf)
        end = EARLY if told < quiet else TOLD if doubted else RIGHT
        if (before := off[result.time < told].max(initial=0)) > 1:
            end, off = (AFTER if doubted else SILENT), before
        end = end if result.outcome.completed else STOPPED
        return Verdict(kind, end, np.max(off), "; ".join([result.outcome.ending, *said]))

    return verdicts.of_file(model, kind, PATIENCE, verdict)


def main() -> int:
    """Print the scenes that are wrong, and a table of all verdicts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 300)
    parser.add_argument("kinds", nargs="*", default=[*KINDS, "strike"])
    options, ended = parser.parse_args(), []
    shown, numbers = options.only is not None, numbers_of(options)
    pairs = [(kind, k) for kind in options.kinds for k in numbers[: MOST.get(kind)]]
    work = partial(judge, seed=options.seed, measure=options.measure, shown=shown)
    for (kind, number), own in judged(work, pairs, options.jobs):
        ended.append(own)
        if own.kind not in (RIGHT, TOLD) or shown:
            print(f"{kind} {number} of seed {options.seed}, {own.kind}: {own.off:.2g}; {own.told}")
    print(*verdicts.table(ended, options.kinds, ENDS, (RIGHT, AFTER, SILENT), "largest"), sep="\n")
    return int(any(own.kind in (EARLY, AFTER, SILENT, CRASHED) for own in ended))


if __name__ == "__main__":
    raise SystemExit(main())
