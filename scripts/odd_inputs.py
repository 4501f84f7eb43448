"""Odd inputs to all public functions and methods, drawn with a seed: how each call ends.

Usage:
  .venv/bin/python scripts/odd_inputs.py [--seed 1] [--count 600] [--all]

Each call gets one argument that is odd, all others are sound. It is
  answered    the value can be meant, as a number of numpy, or None where that is the default;
  refused     by a message of this program that names the argument, or by one of its exceptions;
  FOREIGN     by a message of numpy, pydantic, matplotlib, ..., or by a warning of theirs;
  SILENT      something that can't be meant was taken;
  LOST        a file of the user was changed.
Prints the counts as a table; exit code 1 unless all calls are answered or refused. With --all
every odd value goes to every argument, once.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from decimal import Decimal
from io import StringIO
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pint

import exudyn_flexlink as fl

mpl.use("Agg")
CLASSES = ("answered", "refused", "FOREIGN", "SILENT", "LOST")
NUMBERS = "angle time period length number speed"


@dataclass(frozen=True)
class Odd:
    """A value, and the kinds of arguments that may take it."""

    value: Any
    kinds: str = ""


@dataclass(frozen=True)
class Door:
    """A function, its sound arguments, and the kinds of those that may be odd.

    A kind that ends in '?' may be None. `blind` is an object that knows nothing: only what must be
    refused is tried.
    """

    name: str
    call: Callable[..., Any]
    kinds: Mapping[str, str]
    sound: Mapping[str, Any]
    blind: bool = False

    def accepts(self, odd: Odd, argument: str) -> bool:
        """Whether an argument can be meant so."""
        kind = self.kinds[argument]
        optional = odd.value is None and kind.endswith("?")
        return optional or kind.rstrip("?") in odd.kinds.split()


def odd_values(things: Mapping[str, Any]) -> list[Odd]:
    """Return all that is put in."""
    units = pint.UnitRegistry()
    figure = plt.figure()
    plt.close(figure)
    nothing: Sequence[Any] = (
        float("nan"), float("inf"), -np.inf, np.float64("nan"), 1e300, -1e300, 10**400, 10**5000,
        1j, Decimal(1), b"bytes", "", " ", "\0", "x" * 5000, [], [[1, 2], [3]], {}, {"nix": 1},
        {1: 2}, {"run.turns": float("nan")}, {"run.turns": 0.02, "a": [object()]}, (1, 2, 3), (), set(),
        np.zeros((2, 2)), np.array([]), np.array(["a"]), np.array([None]), object(), object, fl,
        figure, Ellipsis, NotImplemented, range(0), iter(()), np.datetime64("2020-01-01"),
        [float("nan")], [None], ["a", 1], [True], Exception("x"), units("5 kg"), units("3 A"),
        fl.Result, things["film"], things["result"].energy, {"bodies": {"a": None}}, bytearray(3),
        memoryview(b"a"), np.array([[1.0, 2.0]]), [1e400], {"title": 1}, ("a", "b", "c"), None,
    )  # fmt: skip
    names = ("12", "5 parsec", "5 kg", "--force", "null", "nix", ".", "..")
    return [
        *map(Odd, nothing),
        *(Odd(name, "save") for name in names[:-2]),
        *map(Odd, names[-2:]),
        Odd("\udc80", "save"), Odd(Path("mine.txt")), Odd("mine"), Odd("mine.txt/below"),
        Odd("a_sweep", "load_sweep"), Odd("a_run", "load"), Odd(True, "flag"), Odd(np.bool_(0), "flag"),
        Odd(-1, "angle speed"), Odd(-0.5, "angle speed"), Odd(1e-320, "angle time number speed"),
        Odd(0, "angle time number speed whole"), Odd(2.5, NUMBERS), Odd(np.float32(0.25), NUMBERS),
        Odd(np.array([3.0]), f"{NUMBERS} count whole"), Odd(np.array(2), f"{NUMBERS} count whole"),
        Odd("2 ms", "time period"), Odd("20 deg", "angle"), Odd(units("2 ms"), "time period"),
        Odd(units("95 rpm"), "speed"), Odd("1e-3 mm", "length"), Odd(print, "function"),
        Odd(things["scene"], "scene model"), Odd(things["scene"].to_data(), "model"),
        Odd(things["result"], "result"), Odd(things["table"]),
    ]  # fmt: skip


def doors(things: Mapping[str, Any]) -> Iterator[Door]:
    """Yield all public functions and methods, with sound arguments."""
    scene, result, table, film = (things[name] for name in ("scene", "result", "table", "film"))

    def door(name: str, call: Any, /, *, blind: bool = False, **given: tuple[str, Any]) -> Door:
        kinds = {argument: kind for argument, (kind, _) in given.items() if kind}
        sound = {argument: value for argument, (_, value) in given.items()}
        return Door(name, call, kinds, sound, blind)

    run = {"engine": ("name", "exudyn"), "progress": ("function?", None)}
    style, force = {"style": ("name", "screen")}, {"force": ("flag", False)}
    kept = {"folder": ("save?", None), "resume": ("flag", False), **force}
    laps = {"laps": ("count", 1), "after": ("number", 0), "lap": ("period?", None),
            "angle": ("angle", 0.0)}  # fmt: skip
    work = {"workers": ("count?", 1), "scheduler": ("text?", None)}
    yield door("load_scene", fl.load_scene, model=("model", "no_clearance"), changes=("any", ()),
               allow_outside=("flag", False), turns=("period", 0.02), tolerance=("length", 1e-4),
               formulation=("name", "minimal"))  # fmt: skip
    yield door("Scene", fl.Scene, title=("text", "a"))
    yield door("Scene.with_", scene.with_, changes=("any", {}))
    for path, kind in (("drives.motor.value", "speed"), ("bodies.link.length", "none"),
                       ("run.turns", "none"), ("joints.sleeve", "none")):  # fmt: skip
        key = path.split(".")[-1]
        yield door(f"Scene.with_ {path}", lambda path=path, **given: scene.with_({path: next(
            iter(given.values()))}), **{key: (kind, 1)})  # fmt: skip
    yield door("idealise", fl.idealise, scene=("scene", scene), without=("names", "impact"))
    yield door("simulate", fl.simulate, scene=("scene", scene), measure=("flag", False), **run)
    yield door("load", fl.load, folder=("load", "a_run"))
    yield door("compare", fl.compare, first=("result", result), second=("result", result),
               names=("names?", ("a", "b")))  # fmt: skip
    yield door("standard_row", fl.standard_row, result=("result", result))
    sweep = {**run, "row": ("function?", None), "observe": ("function?", None),
             "latin_hypercube": ("count?", None), "random": ("count?", None), "seed": ("whole", 0),
             "series": ("flag", False), **kept, **work, "measure": ("flag", False)}  # fmt: skip
    yield door("sweep", fl.sweep, scene=("scene", scene),
               varied=("any", {"drives.motor.value": [9.0, 10.0]}), **sweep)  # fmt: skip
    yield door("sweep value", lambda value, **more: fl.sweep(scene, {"drives.motor.value": value},
               workers=1, **more), value=("speed", [9.0]), measure=("", False))  # fmt: skip
    yield door("load_sweep", fl.load_sweep, folder=("load_sweep", "a_sweep"))
    yield door("SweepTable.plot", lambda names, **more: table.plot(names, **more),
               names=("name", "wall_s"), **style)  # fmt: skip
    yield door("stability_of", fl.stability_of, scene=("scene", scene), **run, **laps,
               tolerance=("length?", None), twice=("flag", False))  # fmt: skip
    yield door("lyapunov", fl.lyapunov, scene=("scene", scene), laps=("count", 1))
    yield door("bifurcation", fl.bifurcation, scene=("scene", scene), values=("none", [9.0, 10.0]),
               path=("name", "drives.motor.value"), **run, **laps, **kept, **work)  # fmt: skip
    yield door("Comparison.plot", things["compared"].plot, **style)
    yield door("Comparison.exceeds", things["compared"].exceeds, tolerance=("length", 1e-3))
    study, branches = object.__new__(fl.Stability), object.__new__(fl.Branches)
    yield door("Stability.plot", study.plot, blind=True, **style)
    yield door("Stability.save", study.save, blind=True, folder=("save", "out"), **force)
    yield door("Branches.plot", branches.plot, blind=True, axis=("name", "x"), **style)
    yield door("Animation.save", film.save, path=("none", "a.html"), progress=("function?", None),
               **force)  # fmt: skip
    yield door("Result.save", result.save, folder=("save", "out"), **force)
    yield door("Result.report", result.report, path=("save", "out.html"), **force)
    yield door("Result.path", result.path, point=("name", "link.end"))
    yield door("Result.strikes", result.strikes, contact=("name", "strike"))
    yield door("Result.lever", result.lever, body=("name", "lever"))
    yield door("Result.touches", result.touches, name=("name", "strike"))
    yield door("Result.continued", result.continued, at=("time?", 0.001))
    yield door("Result.poincare", result.poincare, angle=("angle", 0.0),
               point=("name?", "link.end"), after=("time", 0.0))  # fmt: skip
    yield door("Result.lap_distances", result.lap_distances, lap=("period?", 1e-3),
               point=("name?", "link.end"), after=("time", 0.0))  # fmt: skip
    yield door("Result.vibration", result.vibration, after=("time", 0.0))
    yield door("Result.to_dataframe", result.to_dataframe, name=("name?", "link.end"))
    yield door("Result.sample_at", result.sample_at, time=("time", 0.001))
    yield door("Result.animate", result.animate, path=("none?", "b.html"), other=("result?", None),
               names=("names?", None), begin=("time?", 0.0), end=("time?", None),
               slow=("name?", None), speed=("number?", None), fps=("number?", None),
               width=("count?", None), progress=("function?", None), **force)  # fmt: skip
    for name in dir(result.plot):
        yield door(f"Result.plot.{name}", getattr(result.plot, name), **style)
    path, lever = result.path("link.end"), result.lever("lever")
    yield door("PointPath.at", path.at, time=("time", 0.001))
    yield door("LeverResponse.value_at", lever.value_at, time=("time", 0.001))
    yield door("LeverResponse.between", lever.between, begin=("time", 0.0), end=("time", 0.01))


def things_of() -> dict[str, Any]:
    """Make what functions take, and files of the user that no call may change."""
    scene = fl.load_scene("rigid", ["accuracy.tolerance=1e-4", "run.turns=0.02"])
    result = fl.simulate(scene, measure=False)
    table = fl.sweep(scene, {"drives.motor.value": [9.0]}, workers=1, folder="a_sweep")
    result.save("a_run")
    Path("mine").mkdir()
    for own in ("mine.txt", "mine/result.nc", "mine/summary.json", "a.html", "b.html", "out.html"):
        if own.endswith(("txt", "nc", "json")):
            Path(own).write_text(f"of the user: {own}", encoding="utf-8")
    return {"scene": scene, "result": result, "table": table, "film": result.animate(),
            "compared": fl.compare(result, result, names=("a", "b"))}  # fmt: skip


def files() -> dict[str, bytes]:
    """Return what the user has."""
    own = [
        Path("mine.txt"),
        *Path("mine").rglob("*"),
        *Path("a_sweep").rglob("*"),
        *Path("a_run").rglob("*"),
    ]
    return {str(file): file.read_bytes() for file in own if file.is_file()}


def outcome(door: Door, argument: str, odd: Odd) -> tuple[str, str]:
    """Make a call; return its class and what it said."""
    before = files()
    try:
        with warnings.catch_warnings(), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            warnings.simplefilter("error")
            found = door.call(**{**door.sound, argument: odd.value})
        end, text = ("answered" if door.accepts(odd, argument) else "SILENT"), repr(found)[:120]
    except BaseException as error:
        text = f"{type(error).__name__}: {str(error)[:300]}"
        end = "refused" if is_own(error, argument, odd) else "FOREIGN"
    if files() != before:
        return "LOST", text
    plt.close("all")
    return end, text


def shown(value: object) -> str:
    """Write a value short."""
    try:
        return repr(value)[:60]
    except ValueError:  # of an int that has too many digits
        return "a long int"


def is_own(error: BaseException, argument: str, odd: Odd) -> bool:
    """Whether an error is this program's, and speaks of Python's arguments."""
    text = str(error)
    if re.search(r"(?<![\w'-])'?--[a-z]", text) and odd.value != "--force":
        return False
    house = type(error).__module__.startswith("exudyn_flexlink") and bool(text)
    named = type(error) in (TypeError, ValueError) and re.search(rf"\b{argument}\b", text)
    return house or bool(named)


def main() -> int:
    """Make all calls and print the table; the exit code is 1 if one ends in a wrong way."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--only", default="", help="functions whose name begins so")
    asked = parser.parse_args()
    count: Counter[str] = Counter()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        things = things_of()
        odd = odd_values(things)
        places = [
            (door, argument, one)
            for door in doors(things) if door.name.startswith(asked.only)
            for argument in door.kinds
            for one in odd if not (door.blind and door.accepts(one, argument))
        ]  # fmt: skip
        drawn = places if asked.all else Random(asked.seed).sample(places, asked.count)
        for door, argument, one in drawn:
            end, text = outcome(door, argument, one)
            count[end] += 1
            if end not in CLASSES[:2]:
                print(f"{end} {door.name}({argument}={shown(one.value)}): {text}", flush=True)
        os.chdir("/")
    print(f"\n| {' | '.join(CLASSES)} |\n|{'---:|' * len(CLASSES)}")
    print(f"| {' | '.join(str(count[name]) for name in CLASSES)} |")
    return 1 if sum(count[name] for name in CLASSES[2:]) else 0


if __name__ == "__main__":
    sys.exit(main())
