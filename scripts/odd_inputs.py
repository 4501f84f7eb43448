"""Odd inputs to all public functions and methods, drawn with a seed: how each call ends.

Usage:
  .venv/bin/python scripts/odd_inputs.py [--seed 1] [--count 600] [--only Result.] [--all]

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
import math
import os
import re
import shutil
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from decimal import Decimal
from functools import partial
from io import StringIO
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pint

import exudyn_flexlink as fl

mpl.use("Agg")
CLASSES = ("answered", "refused", "FOREIGN", "SILENT", "LOST")
MINE = ("mine.txt", "mine", "a_sweep", "a_run")  # what the user has
Arguments = dict[str, tuple[str, Any]]
"""Kinds and sound values of arguments. A kind that ends in '?' may be None."""
Door = tuple[str, Callable[..., Any], Arguments]


def odd_values(of: SimpleNamespace) -> Iterator[tuple[Any, str]]:
    """Yield what is put in, and kinds of arguments that may take it."""
    units, closed = pint.UnitRegistry(), plt.figure()
    plt.close(closed)
    # fmt: off
    for nothing in (
        math.nan, np.float32("nan"), 1e300, -1e300, 10**400, 10**5000, 1j, Decimal(1), b"ab",
        "", " ", "\0", "x" * 5000, ".", "..", [[1, 2], [3]], {"nix": 1}, {1: 2}, {"title": 1},
        {"run.turns": math.nan}, {"run.turns": [object()]}, {"bodies": {"a": None}},
        set(), np.zeros((2, 2)), np.array(["a"]), np.array([None]), [1e400], [None],
        np.array([[1.0, 2.0]]), np.datetime64("2020-01-01"), object(), object, fl, closed, ...,
        [math.nan], ["a", 1], [True], Exception("x"), units("5 kg"),
        units("3 A"), fl.Result, of.film, of.result.energy, of.table, memoryview(b"a"),
        Path("mine.txt"), "mine", "mine.txt/below", ("a", "b", "c"), NotImplemented,
    ):
        yield nothing, ""
    number = "angle time period length number speed span size"
    yield from ((None, ""), ("12", "save speed"), ({}, "changes"), (range(0), "times names"))
    yield from ((iter(()), "names"), ([], "names times changes"), ((), "names times changes"))
    yield from dict.fromkeys(("5 parsec", "5 kg", "--force", "null", "nix"), "save").items()
    yield from (
        ("\udc80", "save"), ("a_sweep", "load_sweep"), ("a_run", "load save"), (True, "flag"),
        (np.bool_(0), "flag"), (-1, "angle speed span"), (-0.5, "angle speed span"),
        (1e-320, "angle time length number speed span times within size"), (math.inf, "span"),
        (0, "angle time number speed whole span times within size"), (2.5, number),
        (np.float32(0.25), number), (np.array([3.0]), f"{number} count whole values"),
        (np.array(2), f"{number} count whole values"), ((1, 2, 3), "values"),
        ([0.001, 0.002], "times within speed values"), (np.array([]), "times names"),
        ("2 ms", "time period span times within save"), ("20 deg", "angle save"),
        (units("2 ms"), "time period span times within"),
        (units("1 ms") * np.ones(2), "times within"), (units("95 rpm"), "speed"),
        ("1e-3 mm", "length save size"), (print, "function"), (of.scene, "scene model"),
        (of.scene.to_data(), "model changes"), (of.result, "result"), (of.axes, "ax"),
    )


def doors(of: SimpleNamespace) -> Iterator[Door]:  # noqa: PLR0915
    """Yield all public functions and methods with their arguments."""
    # fmt: off
    scene, result, table = of.scene, of.result, of.table
    force: Arguments = {"force": ("flag", False)}
    style: Arguments = {"style": ("name", "screen")}
    progress: Arguments = {"progress": ("function?", None)}
    run: Arguments = {"engine": ("name", "exudyn"), **progress}
    kept: Arguments = {"folder": ("save?", None), "resume": ("flag", False), **force}
    laps: Arguments = {"laps": ("count", 1), "after": ("number", 0), "lap": ("period?", None),
                       "angle": ("angle", 0.0)}
    work: Arguments = {"workers": ("count?", 1), "scheduler": ("text?", None)}
    both: Arguments = {"first": ("result", result), "second": ("result", result)}
    own: Arguments = {"scene": ("scene", scene)}
    point: Arguments = {"point": ("name?", "link.end"), "after": ("time", 0.0)}
    # Methods of these look at their arguments first: they need not know anything.
    study, branches = object.__new__(fl.Stability), object.__new__(fl.Branches)
    yield "load_scene", fl.load_scene, {
        "model": ("model", "no_clearance"), "changes": ("changes", ()),
        "allow_outside": ("flag", False)}
    yield "load_scene keywords", partial(fl.load_scene, "rigid"), {
        "turns": ("number", 0.02), "tolerance": ("length", 1e-4)}
    yield "Scene", fl.Scene, {"title": ("any", "a")}
    yield "Scene.with_", scene.with_, {"changes": ("changes", {})}
    for path, kind in (("drives.motor.value", "speed"), ("run.turns", "number"),
                       ("bodies.link.length", "length"), ("joints.sleeve", "any")):
        yield (f"Scene.with_ {path}", lambda p=path, **value: scene.with_({p: value.popitem()[1]}),
               {path.rsplit(".", maxsplit=1)[-1]: (kind, 1)})
    yield "idealise", fl.idealise, {**own, "without": ("names", "impact")}
    yield "equilibrium", fl.equilibrium, own
    yield "simulate", fl.simulate, {**own, "measure": ("flag", False), **run}
    yield "load", fl.load, {"folder": ("load", "a_run")}
    yield "compare", fl.compare, {**both, "names": ("any?", ("a", "b"))}
    series = {"t": [0.0, 0.005, 0.01], "lever.angle": [0.0, 0.01, 0.0]}
    columns: Arguments = {"columns": ("changes?", None)}
    yield "compare measured", partial(fl.compare, result), {
        "second": ("result", series), **columns, "shift": ("span", 0.0)}
    yield "fit", fl.fit, {
        **own, "measured": ("any", series), **columns, "vary": ("any", "springs.nix"), **run}
    yield "joined", fl.joined, both
    yield "exudyn_system", fl.exudyn_system, {"scene": ("scene", of.redundant)}
    yield "standard_row", fl.standard_row, {"result": ("result", result)}
    yield "sweep", fl.sweep, {
        **own, "varied": ("any", {"drives.motor.value": [9.0]}), **run, **kept, **work,
        "row": ("function?", None), "observe": ("function?", None), "seed": ("whole", 0),
        "latin_hypercube": ("count?", None), "random": ("count?", None),
        "series": ("flag", False), "measure": ("flag", False)}
    yield ("sweep value", lambda value: fl.sweep(scene, {"drives.motor.value": value}, workers=1,
           measure=False), {"value": ("speed", [9.0])})
    yield "load_sweep", fl.load_sweep, {"folder": ("load_sweep", "a_sweep")}
    yield ("SweepTable.plot", lambda **given: table.plot(given.pop("names"), **given),
           {"names": ("name", "wall_s"), **style})
    yield "SweepTable[]", lambda column: table[column], {"column": ("name", "wall_s")}
    yield "stability_of", fl.stability_of, {
        **own, **run, **laps, "tolerance": ("length?", None), "twice": ("flag", False)}
    yield "lyapunov", fl.lyapunov, {**own, "laps": ("count", 1)}
    yield "bifurcation", fl.bifurcation, {
        "scene": ("scene", of.tight), "values": ("values", [9.0]),
        "path": ("name", "drives.motor.value"), **run, **laps, **kept, **work}
    yield "Stability.plot", study.plot, {"style": ("blind", "screen")}
    yield "Stability.save", study.save, {"folder": ("blind", "out"), "force": ("blind", False)}
    yield "Branches.plot", branches.plot, {"axis": ("blind", "x"), "style": ("blind", "screen")}
    yield "Comparison.plot", of.compared.plot, style
    yield "Comparison.exceeds", of.compared.exceeds, {"tolerance": ("size", 1e-3)}
    yield "Animation.save", of.film.save, {"path": ("any", "a.html"), **progress, **force}
    yield "Result.save", result.save, {"folder": ("save", "out"), **force}
    yield "Result.report", result.report, {"path": ("save", "out.html"), **force}
    yield "Result.path", result.path, {"point": ("name", "link.end")}
    yield "Result.body", result.body, {"name": ("name", "lever")}
    yield "Result.joint", result.joint, {"name": ("name", "crank")}
    yield "Result.strikes", result.strikes, {"contact": ("name", "strike")}
    yield "Result.lever", result.lever, {"body": ("name", "lever")}
    yield "Result.touches", result.touches, {"name": ("name", "strike")}
    yield "Result.continued", result.continued, {
        "at": ("time?", 0.001), "turns": ("number?", None), "duration": ("period?", None)}
    yield "Result.poincare", result.poincare, {"angle": ("angle", 0.0), **point}
    yield "Result.lap_distances", result.lap_distances, {"lap": ("period?", 1e-3), **point}
    yield "Result.vibration", result.vibration, {"after": ("time", 0.0)}
    yield "Result.to_dataframe", result.to_dataframe, {"name": ("name?", "link.end")}
    yield "Result.sample_at", result.sample_at, {"time": ("time", 0.001)}
    yield "Result.animate", result.animate, {
        "path": ("any?", "b.html"), "other": ("result?", None), "names": ("any?", None),
        "begin": ("time?", 0.0), "end": ("time?", None), "slow": ("name?", None),
        "speed": ("number?", None), "fps": ("number?", None), "width": ("count?", None),
        **progress, **force}
    more: dict[str, Arguments] = {
        "coordinates": {"point": ("name?", None)}, "mechanism": {"instants": ("within?", None)},
        "lever": {"label": ("text?", None)}, "all": style}
    for name in dir(result.plot):
        axes: Arguments = {} if name == "all" else {"ax": ("ax?", None)}
        yield (f"Result.plot.{name}", getattr(result.plot, name),
               {**axes, **style, **more.get(name, {})})
    lever = result.lever("lever")
    yield "PointPath.at", result.path("link.end").at, {"time": ("times", 0.001)}
    yield "LeverResponse.at", lever.at, {"time": ("times", 0.001)}
    yield "LeverResponse.between", lever.between, {"begin": ("span", 0.0), "end": ("span", 0.01)}


def things() -> SimpleNamespace:
    """Make what functions take, and files of the user that no call may change."""
    law = {
        "joints.sleeve.law": {"stiffness": 1e5, "restitution": 0.5},
        "joints.sleeve.clearance": "1 mm",
    }
    scene = fl.load_scene(fl.load_scene("rigid", law), tolerance=1e-4, turns=0.02)
    result = fl.simulate(scene, measure=False)
    table = fl.sweep(scene, {"drives.motor.value": [9.0]}, workers=1, folder="a_sweep")
    result.save("a_run")
    Path("mine").mkdir()
    for own in ("mine.txt", "mine/result.nc", "mine/summary.json"):
        Path(own).write_text("of the user", encoding="utf-8")
    compared = fl.compare(result, result, names=("a", "b"))
    redundant = scene.with_({"solver.formulation": "redundant"})
    tight = fl.load_scene("rigid", tolerance=1e-4, turns=0.02)  # its laps take no time
    axes = plt.figure().add_subplot()
    return SimpleNamespace(
        scene=scene, result=result, table=table, compared=compared, redundant=redundant,
        tight=tight,
        film=result.animate(), axes=axes,
    )  # fmt: skip


def files() -> dict[str, bytes]:
    """Return what the user has."""
    every = [file for name in MINE for file in (Path(name), *Path(name).rglob("*"))]
    return {str(file): file.read_bytes() for file in every if file.is_file()}


def outcome(call: Callable[..., Any], argument: str, odd: Any, *, meant: bool) -> tuple[str, str]:
    """Make a call; return its class and what it said."""
    before = files()
    try:
        with warnings.catch_warnings(), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            warnings.simplefilter("error")
            found = call(**{argument: odd})
        end, text = "answered" if meant else "SILENT", repr(found)[:120]
    except BaseException as error:
        text = f"{type(error).__name__}: {str(error)[:300]}"
        house = type(error).__module__.startswith("exudyn_flexlink")
        known = house or type(error) in (KeyError, TypeError, ValueError)
        option = re.search(r"(?<![\w-])--[a-z]", text) and "--force" not in text
        named = house or re.search(rf"\b{argument}\b", text)
        end = "refused" if known and named and not option else "FOREIGN"
    plt.close("all")
    if files() != before:
        end = "LOST"
    for made in {*Path().iterdir()} - {*map(Path, MINE)}:
        shutil.rmtree(made) if made.is_dir() else made.unlink()
    return end, text


def main() -> int:
    """Make all calls and print the table; the exit code is 1 if one ends in a wrong way."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--only", default="", help="functions whose name begins so")
    parser.add_argument("--all", action="store_true")
    asked, count = parser.parse_args(), Counter[str]()
    sys.set_int_max_str_digits(10_000)
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        of = things()
        odd = list(odd_values(of))
        calls = [
            (name, call, argument, arguments, value, kinds)
            for name, call, arguments in doors(of) if name.startswith(asked.only)
            for argument, (kind, _) in arguments.items()
            for value, kinds in odd if kind != "blind" or not kinds
        ]  # fmt: skip
        few = min(asked.count, len(calls))
        for name, call, argument, arguments, value, kinds in (
            calls if asked.all else Random(asked.seed).sample(calls, few)
        ):
            kind = arguments[argument][0]
            meant = kind.rstrip("?") in kinds.split() or (value is None and kind.endswith("?"))
            sound = {key: own for key, (_, own) in arguments.items() if key != argument}
            end, text = outcome(partial(call, **sound), argument, value, meant=meant)
            count[end] += 1
            if end not in CLASSES[:2]:
                print(f"{end} {name}({argument}={repr(value)[:60]}): {text}", flush=True)
        os.chdir("/")
    print(f"\n| {' | '.join(CLASSES)} |\n|{'---:|' * len(CLASSES)}")
    print(f"| {' | '.join(str(count[name]) for name in CLASSES)} |")
    return 1 if sum(count[name] for name in CLASSES[2:]) else 0


if __name__ == "__main__":
    sys.exit(main())
