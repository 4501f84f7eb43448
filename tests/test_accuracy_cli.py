"""The command `accuracy`, end to end on a small scene, with real engines."""

import json
import shlex
import signal

import pytest
from cli_runs import MODELS

from exudyn_flexlink import engines
from exudyn_flexlink.cli import main
from exudyn_flexlink.cli.studying import Watch
from exudyn_flexlink.comparison import compare
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.storage import load

SMALL = [str(MODELS / "smooth.yaml"), "--set=bodies.link.rods=2", "--set=run.turns=0.05"]


def accuracy(*arguments):
    return main(["accuracy", *SMALL, *arguments])


def test_the_command_that_is_advised_keeps_its_promise(tmp_path, capsys):
    """It runs as printed, the scene that was studied, and is as near to the truth as it says."""
    target, changes = 1e-5, ["--set=drives.motor.value=25 rad/s", "--watch=link.end"]
    changes += ["--without=damping", "--set=accuracy.step=1e-4"]
    folder = tmp_path / "study"
    assert accuracy("--budget=6", f"--target={target}", f"--out={folder}", *changes) == 0
    told = capsys.readouterr().out
    assert sorted(file.name for file in folder.iterdir()) == [
        "accuracy.csv", "accuracy.json", "accuracy.png", "manifest.json",
    ]  # fmt: skip
    data = json.loads((folder / "accuracy.json").read_text())
    assert data["target_m"] == target
    assert data["recommendation"] in told
    assert data["advice"]["choice"]["error_largest_m"] <= target / 3
    assert data["reference"]["run"] == "Lagrangian, tolerance 1e-12 m"
    assert data["check"]["independent"]
    assert data["floor_m"] < target
    [own] = (p for p in data["points"] if (p["method"], p["value"]) == ("Exudyn, fixed step", 1e-4))
    assert data["own"] == "Exudyn, step 0.0001 s"
    assert own["processor_time_s"] > 0
    assert {p["method"] for p in data["points"]} >= {"Exudyn, minimal", "Lagrangian"}
    assert {source["kind"] for source in data["sources"]} >= {"time"}
    assert not data["interrupted"]
    command = shlex.split(told.split("\nThat is: ")[1].splitlines()[0])
    ran = command[command.index("simulate") :]
    assert main([*ran, "--no-plots", "--quiet", f"--out={tmp_path / 'run'}"]) == 0
    made = load(tmp_path / "run")
    settings = ["bodies.link.rods=2", "run.turns=0.05", "drives.motor.value=25 rad/s"]
    tight = ["outputs.watch=link.end", "accuracy.tolerance=1e-12"]
    scene = idealise(load_scene(MODELS / "smooth.yaml", [*settings, *tight]), ["damping"])
    exact = engines.simulate(scene, "lagrangian", measure=False)
    assert made.outcome.time == pytest.approx(exact.outcome.time, rel=1e-12)
    assert compare(exact, made).deviation.largest <= target / 3


def interrupt_after(runs, monkeypatch):
    """Let Ctrl-C fall into the first run after so many settings; those warming up don't count."""
    whole, settings = engines.simulate, set()

    def simulate(scene, engine, progress, **more):
        if scene.run.turns is not None:
            settings.add((engine, repr(scene.accuracy), repr(scene.solver)))
        if len(settings) > runs:
            raise KeyboardInterrupt
        return whole(scene, engine, progress, **more)

    monkeypatch.setattr(engines, "simulate", simulate)


def test_ctrl_c_keeps_what_was_computed(tmp_path, capsys, monkeypatch):
    interrupt_after(2, monkeypatch)
    assert accuracy("--budget=60", f"--out={tmp_path / 'out'}", "--no-plots") == 130
    said = capsys.readouterr()
    assert "interrupted: the 1 setting judged until then, in" in said.err  # the other judges
    data = json.loads((tmp_path / "out" / "accuracy.json").read_text())
    assert data["interrupted"]
    assert len(data["points"]) == 1
    assert "Recommendation: " in said.out


@pytest.mark.parametrize("runs", [0, 1])
def test_ctrl_c_before_there_is_anything_to_compare_writes_nothing(
    runs, tmp_path, capsys, monkeypatch
):
    interrupt_after(runs, monkeypatch)
    assert accuracy(f"--out={tmp_path / 'out'}") == 130
    assert capsys.readouterr().err == (
        "interrupted before there were two runs to compare; nothing was written\n"
    )
    assert not list(tmp_path.iterdir())


def test_a_run_that_takes_longer_than_it_may_is_stopped(monkeypatch):
    now, sent = [0.0], []
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr(signal, "raise_signal", sent.append)
    watch = Watch(20.0, lambda: None)
    now[0] = 20.0
    watch(0.1)
    assert not sent
    now[0] = 21.0
    watch(0.1)
    watch(0.1)
    assert sent == [signal.SIGINT]
    assert watch.given_up
