"""Both engines at a terminal: which one runs, what is refused, and the command `compare`.

Most runs here are made by closed form (`results`); those of the last section are real.
"""

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from cli_runs import MODELS, NO_CLEARANCE, row
from matplotlib.figure import Figure
from results import rigid_link, solved_to, stopped

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import MeasuredError, Outcome
from exudyn_flexlink.storage import load

CLEARANCE = str(MODELS / "clearance.yaml")


# --- engines and impacts --------------------------------------------------------------------


def test_an_integrator_is_for_the_lagrangian(run_of, capsys):
    seen = []
    run_of(engines(seen=seen))
    quiet = ["--no-plots", "--quiet", "--out", "here"]
    asked = ["--set", "solver.integrator=dop853"]
    assert main(["simulate", NO_CLEARANCE, "--engine", "lagrangian", *asked, *quiet]) == 0
    assert main(["simulate", NO_CLEARANCE, *quiet]) == 0
    assert [engine for engine, _ in seen] == ["lagrangian", "exudyn"]
    assert seen[0][1].solver.integrator == "dop853"
    for setting in (asked[1], "solver={integrator: dop853}"):
        assert main(["simulate", NO_CLEARANCE, "--set", setting]) == 2
        assert "is for '--engine lagrangian'" in capsys.readouterr().err


def parting(engine, at):
    """Measure runs; two of an engine part at an instant (s)."""

    def measured(run):
        horizon = at if run.engine == engine else None
        error = MeasuredError(("link.end",), limit=1e-6, largest=1e-7, horizon=horizon)
        return replace(run, error=error)

    return measured


# --- compare, with runs made by closed form ---------------------------------------------------


def engines(*, off=0.0, seen=None):
    """Differ by `off` (m) in x; put S of a scene with clearance 1 mm higher."""
    calls = [] if seen is None else seen

    def fake(scene, engine="exudyn", progress=None):
        calls.append((engine, scene))
        made = rigid_link(scene=scene, samples=801)
        poses = made.poses.copy()
        poses[..., 0] += off if engine == "exudyn" else 0.0
        poses[..., 1] += 1e-3 if scene.joints["sleeve"].clearance else 0.0
        settings = solved_to(scene.accuracy.tolerance)
        return replace(made, engine=engine, poses=poses, settings=settings)

    return fake


def test_compare_runs_both_and_writes_what_it_found(run_of, monkeypatch, capsys):
    seen = []
    run_of(engines(off=2e-6, seen=seen))
    monkeypatch.setattr("exudyn_flexlink.plots.figures", lambda *_: {"lever": Figure((1, 1))})
    assert main(["compare", NO_CLEARANCE, "--tolerance", "3e-6"]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("Comparison of exudyn and lagrangian: Extensible flexible link")
    assert row(shown.out, "whole")[2:4] == ["2e-06", "m"]
    assert shown.err == "warning: exudyn: made up\nwarning: lagrangian: made up\n"
    folder = Path("runs/no_clearance-compare")
    for name in ("comparison.json", "comparison.csv", "comparison.png",
                 "exudyn/summary.json", "lagrangian/lever.png"):  # fmt: skip
        assert (folder / name).is_file()
    told = "Written to {}:\n  comparison.csv, comparison.json, comparison.png, manifest.json, {}"
    inside = "exudyn/ (10 files), lagrangian/ (10 files)"
    assert told.format(f"{folder}{os.sep}", inside) in shown.out
    assert [engine for engine, _ in seen] == ["lagrangian", "exudyn"]


def test_compare_ends_with_1_beyond_its_tolerance(run_of, capsys):
    run_of(engines(off=2e-6))
    arguments = ["compare", NO_CLEARANCE, "--no-plots", "--quiet", "--out", "here"]
    assert main(arguments) == 0  # it only tells
    assert capsys.readouterr().out == ""
    assert main([*arguments, "--tolerance", "1.9e-6"]) == 1
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "link.end deviates by 2e-06 m" in shown.err
    assert "more than the 1.9e-06 m allowed" in shown.err
    assert json.loads(Path("here/comparison.json").read_text(encoding="utf-8"))["exceeded"] is True


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_compare_judges_up_to_the_horizon(engine, run_of, capsys):
    run_of(engines(off=2e-6), parting(engine, 1.0))
    assert main(["compare", NO_CLEARANCE, "--no-plots"]) == 0
    told = capsys.readouterr().out
    assert "instant by instant up to t = 1 s, beyond it by statistics" in told
    assert f"two runs of {engine} part for good" in told
    assert main(["compare", NO_CLEARANCE, "--no-plots", "--no-measure"]) == 0
    assert "no horizon was looked for" in capsys.readouterr().out


def test_compare_keeps_and_explains_a_failed_run(run_of, capsys):
    fake = engines()
    run_of(
        lambda scene, engine, progress=None: (
            stopped(fake(scene, engine)) if engine == "exudyn" else fake(scene, engine)
        )
    )
    assert main(["compare", NO_CLEARANCE, "--no-plots", "--quiet", "--out", "here"]) == 1
    assert "exudyn: the run stopped at 0.5 s: no convergence" in capsys.readouterr().err
    assert Path("here/comparison.json").is_file()


def test_a_comparison_interrupted_in_its_first_run_leaves_nothing(run_of, capsys):
    def fake(scene, engine="exudyn", progress=None):
        return replace(rigid_link(scene=scene), outcome=Outcome(False, 0.5, "interrupted"))

    run_of(fake)
    assert main(["compare", NO_CLEARANCE]) == 130
    assert capsys.readouterr().err == (
        "interrupted before two runs were compared; nothing was written\n"
    )
    assert list(Path().iterdir()) == []


def test_what_the_lagrangian_cant_represent_is_shown_before_exudyn_runs(run_of, capsys):
    def fake(scene, engine="exudyn", progress=None):
        assert engine == "lagrangian"
        raise NotRepresentableError(("joints", "pin"), "no such slot")

    run_of(fake)
    assert main(["compare", NO_CLEARANCE]) == 2
    said = capsys.readouterr().err
    assert "joints.pin: no such slot" in said
    assert "refused by the engine 'lagrangian'" in said
    assert list(Path().iterdir()) == []


# --- compare a scene with itself without an effect --------------------------------------------


@pytest.mark.parametrize("engine", [None, "lagrangian"])
def test_compare_a_scene_with_and_without_its_clearance(engine, run_of, capsys):
    seen = []
    run_of(engines(seen=seen))
    which = ["--engine", engine] if engine else []
    assert main(["compare", CLEARANCE, "--without", "clearance", "--no-plots", *which]) == 0
    assert [name for name, _ in seen] == [engine or "exudyn"] * 2
    # The paper's (a), without clearance, then its (b).
    assert [scene.joints["sleeve"].clearance for _, scene in seen] == [0, 5e-3]
    shown = capsys.readouterr()
    title = load_scene(CLEARANCE).title
    assert shown.out.startswith(f"Comparison without clearance and with clearance: {title}\n")
    assert row(shown.out, "whole")[2:4] == ["0.001", "m"]
    assert row(shown.out, "engine") == ["engine", *[engine or "exudyn"] * 2]
    assert "warning: without clearance: made up\nwarning: with clearance: made up\n" in shown.err
    other = "-lagrangian" if engine == "lagrangian" else ""
    folder = Path(f"runs/clearance-compare{other}-without_clearance")
    for name in ("comparison.json", "comparison.csv", "without_clearance/summary.json"):
        assert (folder / name).is_file()
    found = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))
    assert list(found["runs"]) == ["without clearance", "with clearance"]
    assert found["title"] == title


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--without", "friction"], "nothing to compare: both scenes would be the same"),
        (["--engine", "lagrangian"], "'--engine' belongs to '--without'; else both engines run"),
        (["--without", "clearance", "--set", "solver.integrator=dop853"], "is for '--engine"),
        (["--without", "clearance", "--set", "run.turns=no"], "expected a number, got 'no'"),
        # Without the strike nothing says that the link's start is what to look at.
        (
            ["--set", "contacts.strike.point=link.start", "--without", "impact"],
            "can't compare: the point watched is link.start, but link.end without impact",
        ),
    ],
)
def test_what_compare_refuses_before_it_runs(arguments, said, run_of, capsys):
    run_of(None)
    assert main(["compare", CLEARANCE, *arguments]) == 2
    assert said in capsys.readouterr().err
    assert list(Path().iterdir()) == []


# --- real runs ------------------------------------------------------------------------------


def test_a_real_comparison(tmp_path, capsys):
    """A part of a turn of the smooth scene: the engines agree to the error Exudyn was allowed."""
    target = tmp_path / "found"
    short = ["run.turns=0.2", "bodies.link.rods=3", "accuracy.tolerance=1e-6"]
    settings = [word for setting in short for word in ("--set", setting)]
    command = ["compare", str(MODELS / "smooth.yaml"), *settings, "--no-plots", f"--out={target}"]
    assert main([*command, "--tolerance", "1e-6"]) == 0
    assert "Compared instant by instant to" in capsys.readouterr().out
    found = json.loads((target / "comparison.json").read_text(encoding="utf-8"))
    assert found["exceeded"] is False
    assert found["horizon_s"] is None
    told = sum(load(target / name).error.largest for name in ("exudyn", "lagrangian"))
    assert 0 < found["deviation"]["whole_run"]["largest_m"] < told < 1e-6
