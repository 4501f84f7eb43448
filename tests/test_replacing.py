"""A run replaces the files that a run wrote, and nothing of the user's."""

import json
import os
import signal
import stat
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Thread

import pytest
import results
from results import rigid_link

from exudyn_flexlink import engines, storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.result import Outcome
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.storage import KeptBesideError, StorageError, load, own_files, staged_folder

ROOT = Path(__file__).parents[1]
NO_CLEARANCE = str(ROOT / "models" / "no_clearance.yaml")
SPLINE = ROOT / "models" / "spline_track.yaml"
posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def tree(folder="."):
    """All files in a folder with their content; links are not followed."""
    paths = sorted(path for path in Path(folder).rglob("*") if path.is_symlink() or path.is_file())
    return {
        path.relative_to(folder).as_posix(): os.readlink(path)
        if path.is_symlink()
        else path.read_bytes()
        for path in paths
    }


def mine(*names):
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text("mine", encoding="utf-8")


@pytest.fixture
def ends(monkeypatch):
    """Put closed form in place of the engines, with a way to end."""

    def as_(completed=True, reason="no convergence"):
        def fake(scene, engine, progress=None, **_):
            made = replace(rigid_link(scene=scene, samples=201), engine=engine, warnings=())
            made = replace(made, settings={"tolerance": scene.accuracy.tolerance or 0.0})
            return made if completed else replace(made, outcome=Outcome(False, 0.5, reason))

        monkeypatch.setattr(engines, "simulate", fake)

    as_()
    return as_


def simulate(*options):
    return main(["simulate", NO_CLEARANCE, "--no-plots", "--quiet", "--out=o", *options])


# --- what stays ---------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["simulate", "compare"])
def test_a_rerun_leaves_the_users_files_and_folders(command, ends):
    again = [command, NO_CLEARANCE, "--quiet", "--no-plots", "--out=o"]
    assert main(again) == 0
    written = set(tree("o"))
    mine("o/nested/notes", "o/data/measured.csv", "o/exudyn/own.txt", "o/zebra.png")
    Path("o/empty").mkdir()
    assert main(again) == 0
    assert set(tree("o")) - written == {
        "nested/notes", "data/measured.csv", "exudyn/own.txt", "zebra.png",
    }  # fmt: skip
    assert Path("o/empty").is_dir()
    assert set(own_files(Path("o"))) == written


@pytest.mark.parametrize("summary", ['{"program": "exudyn-flexlink", "format": 2}', None])
def test_a_folder_without_manifest_is_left_alone(summary, ends, capsys):
    """Of an earlier version, or the user's own with a summary that only looks like ours."""
    storage.save(results.pendulum(), Path("o"))
    if summary is not None:
        Path("o/summary.json").write_text(summary, encoding="utf-8")
    mine("o/thesis.tex")
    before = tree("o")
    assert simulate() == 2
    said = capsys.readouterr().err
    assert "no manifest.json names them; choose another name, or give '--force'" in said
    assert tree("o") == before
    assert simulate("--force") == 0
    assert load(Path("o")).scene.title.startswith("Extensible")
    assert tree("o")["thesis.tex"] == b"mine"
    assert "trajectory_rod.end.csv" in tree("o")  # of the pendulum: no manifest says whose it is


def test_a_file_that_the_user_changed_is_not_replaced(ends, capsys):
    assert simulate() == 0
    changed = Path("o/trajectory_link.end.csv")
    changed.write_text("t_s\n", encoding="utf-8")
    engine, engines.simulate = engines.simulate, None  # told before anything runs
    assert simulate() == 2
    place = changed.resolve()
    assert capsys.readouterr().err == (
        f"{place} was changed since the run there wrote it; rename it, choose another folder, or "
        "replace it with '--force'\n"
    )
    engines.simulate = engine
    assert simulate("--force") == 0
    assert changed.stat().st_size > 4


def test_files_that_are_no_longer_written_go_unless_the_user_changed_them():
    for changed in (False, True):
        results.put(rigid_link(samples=201), "o")
        if changed:
            mine("o/lever_lever.csv")
        with staged_folder(Path("o"), force=changed) as folder:
            storage.save(results.pendulum(), folder)
        assert Path("o/lever_lever.csv").exists() == changed
        assert not Path("o/trajectory_link.end.csv").exists()


def test_a_comparison_gives_way_to_a_run_without_the_users_files_in_it(ends):
    assert main(["compare", NO_CLEARANCE, "--quiet", "--no-plots", "--out=o"]) == 0
    mine("o/lagrangian/notes")
    assert simulate() == 0
    assert sorted(path.name for path in Path("o").iterdir() if path.is_dir()) == ["lagrangian"]
    assert tree("o/lagrangian") == {"notes": b"mine"}
    assert not Path("o/comparison.json").exists()


def test_a_file_that_appears_while_the_run_goes_on_is_not_replaced():
    def write():
        with staged_folder(Path("o")) as folder:
            storage.save(results.pendulum(), folder)
            results.put(rigid_link(samples=201), "o")
            mine("o/trajectory_rod.end.csv")

    with pytest.raises(KeptBesideError, match="is the user's: no manifest") as told:
        write()
    assert told.value.folder == Path("o-2").resolve()
    assert load(Path("o-2")).scene.title == "pendulum"
    assert tree("o")["trajectory_rod.end.csv"] == b"mine"
    assert load(Path("o")).outcome.completed


@pytest.mark.parametrize("name", ["../mine", "/mine", "..", "a/b"])
def test_a_manifest_names_nothing_outside_its_folder(name):
    results.put(results.pendulum(), "o")
    mine("mine")
    manifest = json.loads(Path("o/manifest.json").read_text(encoding="utf-8"))
    manifest["files"][name] = storage.manifest.digest(Path("mine"))
    Path("o/manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    with pytest.raises(StorageError, match="no run of this program"), staged_folder(Path("o")):
        raise AssertionError("too late")
    assert Path("mine").exists()


# --- complete and incomplete --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "reason", "code"),
    [
        ("simulate", "no convergence", 1),
        ("simulate", "interrupted", 130),
        ("compare", "no convergence", 1),
    ],
)
def test_an_incomplete_run_does_not_replace_a_complete_one(command, reason, code, ends, capsys):
    again = [command, NO_CLEARANCE, "--no-plots", "--out=o"]
    assert main(again) == 0
    before = tree("o")
    ends(False, reason)
    capsys.readouterr()
    assert main(again) == code
    said = capsys.readouterr()
    assert tree("o") == before
    kind = {"simulate": "run", "compare": "comparison"}[command]
    place = Path("o").resolve()
    assert f"{place} holds a complete {kind} of 'Extensible flexible link" in said.err
    assert "this one is incomplete" in said.err
    assert said.err.endswith(f"give '--force'. What was computed is in {place}-2\n")
    assert f"Written to {place}-2/: " in said.out
    folder = Path("o-2") if command == "simulate" else Path("o-2/exudyn")
    assert not load(folder).outcome.completed
    assert main([*again, "--force"]) == code
    assert tree("o") != before
    ends(True)
    assert main(again) == 0  # a complete one replaces an incomplete one
    assert sorted(path.name for path in Path().iterdir()) == ["o", "o-2"]


def test_an_interrupted_study_does_not_replace_a_complete_one(study):
    for interrupted in (False, True):
        found = replace(study, runs=replace(study.runs, interrupted=interrupted))
        written = staged_folder(Path("o"))
        if interrupted:
            with pytest.raises(KeptBesideError, match="holds a complete study of"), written as o:
                storage.save_accuracy(found, "", o)
        else:
            with written as folder:
                storage.save_accuracy(found, "", folder)
    assert json.loads(Path("o/accuracy.json").read_text())["interrupted"] is False
    assert json.loads(Path("o-2/accuracy.json").read_text())["interrupted"] is True


def test_a_comparison_without_its_horizon_is_not_complete(ends, monkeypatch):
    again = ["compare", NO_CLEARANCE, "--no-plots", "--quiet", "--out=o"]
    assert main(again) == 0
    whole, made = engines.simulate, []

    def stops_in_the_third(*arguments, **more):
        made.append(1)
        result = whole(*arguments)
        stopped = Outcome(False, 0.5, "interrupted")
        return replace(result, outcome=stopped) if len(made) == 3 else result

    monkeypatch.setattr(engines, "simulate", stops_in_the_third)
    assert main(again) == 130
    assert json.loads(Path("o/comparison.json").read_text())["completed"] is True
    assert json.loads(Path("o-2/comparison.json").read_text())["completed"] is False


# --- killed, or failing, in between -------------------------------------------------------------


class KilledError(BaseException):
    """Nothing that follows is done."""


RENAMES = 10  # of the folder, of 5 old files, of 4 new ones


@pytest.mark.parametrize("move", range(RENAMES))
def test_what_a_killed_process_began_is_finished_by_whoever_opens_the_folder(move, monkeypatch):
    results.put(rigid_link(samples=201), "o")
    mine("o/data/measured.csv")
    before = tree("o")
    rename, made = os.rename, []

    def killed(source, target):
        if len(made) >= move:
            raise KilledError
        made.append(target)
        rename(source, target)

    def write(patch):
        with staged_folder(Path("o")) as folder:
            storage.save(results.pendulum(), folder)
            patch.setattr(os, "rename", killed)

    with monkeypatch.context() as patch, pytest.raises(KilledError):
        write(patch)
    title = load(Path("o")).scene.title
    if move == 0:
        assert title == rigid_link(samples=2).scene.title
        assert {k: v for k, v in tree("o").items() if not k.startswith(".")} == before
    else:
        assert title == "pendulum"
        assert set(tree("o")) == {
            "data/measured.csv", "manifest.json", "result.nc", "summary.json",
            "trajectory_rod.end.csv",
        }  # fmt: skip
    results.put(rigid_link(samples=201), "o")
    assert set(tree("o")) == set(before)


@pytest.mark.parametrize("move", range(RENAMES))
def test_a_move_that_fails_undoes_the_others(move, monkeypatch):
    results.put(rigid_link(samples=201), "o")
    mine("o/data/measured.csv")
    before = tree("o")
    rename, made = os.rename, []

    def refused(source, target):
        made.append(target)
        if len(made) == move + 1:
            raise PermissionError(1, "Operation not permitted")
        rename(source, target)

    def write():
        with staged_folder(Path("o")) as folder:
            storage.save(results.pendulum(), folder)
            monkeypatch.setattr(os, "rename", refused)

    with pytest.raises(KeptBesideError, match="What was computed is in"):
        write()
    assert tree("o") == before
    assert load(Path("o-2")).scene.title == "pendulum"


def test_ctrl_c_while_a_run_is_put_in_its_place_is_told_and_costs_nothing(
    ends, monkeypatch, capsys
):
    assert simulate() == 0
    rename = os.rename

    def pressed(source, target):
        signal.raise_signal(signal.SIGINT)
        rename(source, target)

    monkeypatch.setattr(os, "rename", pressed)
    assert simulate() == 130
    assert capsys.readouterr().err == "interrupted: the run is whole, in o/\n"
    assert load(Path("o")).outcome.completed


@posix
def test_many_runs_that_end_at_once_leave_one_whole():
    many = [results.pendulum(), rigid_link(samples=51)] * 4

    def write(result):
        for _ in range(5):
            results.put(result, "o")

    mine("o/data/measured.csv")
    with staged_folder(Path("o"), force=True) as folder:
        storage.save(results.pendulum(), folder)
    threads = [Thread(target=write, args=(result,)) for result in many]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert load(Path("o")).outcome.completed
    assert set(tree("o")) == set(own_files(Path("o"))) | {"data/measured.csv"}
    assert sorted(path.name for path in Path().iterdir()) == ["o"]


# --- links, devices, pipes ----------------------------------------------------------------------


@posix
def test_a_link_to_a_folder_may_be_where_to_write():
    Path("big_disk").mkdir()
    Path("o").symlink_to("big_disk")
    for _ in range(2):
        results.put(results.pendulum(), "o")
    assert Path("o").is_symlink()
    assert load(Path("big_disk")).scene.title == "pendulum"


@posix
@pytest.mark.parametrize("name", ["result.nc", "manifest.json"])
@pytest.mark.parametrize("force", [[], ["--force"]])
def test_a_link_in_a_run_is_neither_followed_nor_replaced(name, force, ends, capsys):
    assert simulate() == 0
    Path("o", name).rename("elsewhere")
    Path("o", name).symlink_to(Path("elsewhere").resolve())
    before = tree()
    assert simulate(*force) == 2
    said = capsys.readouterr().err
    assert "is a link" in said or "no manifest.json names them" in said
    assert {k: v for k, v in tree().items() if not k.startswith("o-2")} == before


@posix
def test_a_linked_folder_in_a_comparison_is_not_written_into(ends, capsys):
    Path("elsewhere").mkdir()
    Path("o").mkdir()
    Path("o/exudyn").symlink_to("../elsewhere")
    again = ["compare", NO_CLEARANCE, "--quiet", "--no-plots", "--out=o", "--force"]
    assert main(again) == 2
    assert "exudyn is a link; it is never replaced" in capsys.readouterr().err
    assert not list(Path("elsewhere").iterdir())


@posix
def test_what_is_saved_by_hand_replaces_no_link(study):
    for name in ("summary.json", "accuracy.csv"):
        Path(name).symlink_to("elsewhere")
    with pytest.raises(StorageError, match=r"summary\.json is a link"):
        storage.save(results.pendulum(), Path())
    with pytest.raises(StorageError, match=r"accuracy\.csv is a link"):
        storage.save_accuracy(study, "", Path())
    assert not Path("elsewhere").exists()


@posix
def test_models_and_points_are_not_read_from_pipes_and_devices(capsys):
    os.mkfifo("model.yaml")
    for model in ("model.yaml", "/dev/null"):
        assert main(["check", model]) == 2
        assert f"{model}: not a file but a pipe or a device" in capsys.readouterr().err
    os.mkfifo("points.csv")
    text = SPLINE.read_text(encoding="utf-8").replace("track_points.csv", "points.csv")
    Path("track.yaml").write_text(text, encoding="utf-8")
    assert main(["check", "track.yaml"]) == 2
    said = capsys.readouterr().err
    assert "track.yaml:13:31: curves.track.file: 'points.csv' is a pipe or a device" in said


@posix
@pytest.mark.parametrize("name", ["summary.json", "result.nc", "manifest.json"])
def test_a_run_is_not_read_from_a_pipe(name, ends, capsys):
    assert simulate() == 0
    Path("o", name).unlink()
    os.mkfifo(Path("o", name))
    assert main(["plot", "o"]) == 2
    assert f"{name}" in capsys.readouterr().err
    assert simulate() == 2


@posix
def test_a_pipe_is_no_run(capsys):
    os.mkfifo("pipe")
    assert main(["plot", "pipe"]) == 2
    assert "pipe is no folder" in capsys.readouterr().err


# --- names, figures, schemas --------------------------------------------------------------------


@pytest.mark.parametrize("name", ["..yaml", "...yaml"])
@pytest.mark.parametrize(("command", "suffix"), [("simulate", ""), ("compare", "-compare")])
def test_a_model_of_dots_writes_into_a_folder_of_its_own(name, command, suffix, ends):
    Path(name).write_text(Path(NO_CLEARANCE).read_text(encoding="utf-8"), encoding="utf-8")
    assert main([command, name, "--quiet", "--no-plots"]) == 0
    assert [path.name for path in Path("runs").iterdir()] == [name + suffix]
    assert sorted(path.name for path in Path().iterdir()) == [name, "runs"]


def test_figures_of_the_users_are_not_replaced(ends, capsys):
    assert main(["simulate", NO_CLEARANCE, "--quiet", "--out=o"]) == 0
    assert main(["plot", "o"]) == 0
    mine("o/polar.png")
    before = tree("o")
    assert main(["plot", "o"]) == 2
    assert "polar.png was changed since the run there wrote it" in capsys.readouterr().err
    assert tree("o") == before
    assert main(["plot", "o", "--force"]) == 0
    assert tree("o")["polar.png"] != b"mine"
    assert main(["simulate", NO_CLEARANCE, "--quiet", "--no-plots", "--out=o"]) == 0
    assert not list(Path("o").glob("*.png"))  # they were of the earlier run


def test_figures_may_be_added_to_any_folder_and_take_nothing_away(ends, capsys):
    assert main(["compare", NO_CLEARANCE, "--quiet", "--no-plots", "--out=o"]) == 0
    mine("figures/forces.png")
    assert main(["plot", "o/exudyn", "--out=figures"]) == 2
    assert "forces.png is the user's: no manifest.json names it" in capsys.readouterr().err
    assert tree("figures") == {"forces.png": b"mine"}
    before = set(tree("o"))
    for folder in ("o", "o/exudyn"):
        assert main(["plot", "o/exudyn", "--out", folder]) == 0
    assert before < set(tree("o"))
    assert main(["compare", NO_CLEARANCE, "--quiet", "--no-plots", "--out=o"]) == 0
    assert set(tree("o")) == before


def test_a_schema_replaces_only_a_schema(capsys):
    text = json.dumps(json_schema())
    Path("schema.json").write_text(text.replace("SI", "si"), encoding="utf-8")
    assert main(["schema", "--out=schema.json"]) == 0
    mine("model.yaml")
    assert main(["schema", "--out=model.yaml"]) == 2
    assert "model.yaml: this program did not write what is in it" in capsys.readouterr().err
    assert tree()["model.yaml"] == b"mine"
    assert main(["schema", "--out=model.yaml", "--force"]) == 0
    assert json.loads(tree()["model.yaml"]) == json_schema()


@posix
@pytest.mark.parametrize("force", [[], ["--force"]])
def test_a_schema_replaces_no_link_device_or_pipe(force, capsys):
    mine("real.json")
    Path("link.json").symlink_to("real.json")
    os.mkfifo("pipe")
    places = [("link.json", "link"), ("pipe", "pipe")]
    with suppress(PermissionError):  # only root makes devices, and only for root is this a danger
        os.mknod("full", stat.S_IFCHR | 0o666, os.makedev(1, 7))
        places.append(("full", "device"))
    for place, kind in places:
        assert main(["schema", "--out", place, *force]) == 2
        said = capsys.readouterr().err
        assert said == f"can't write {place}: it is a {kind}; give a new name\n"
    assert Path("pipe").is_fifo()
    assert Path("full").is_char_device() == (len(places) == 3)
    assert tree() == {"link.json": "real.json", "real.json": b"mine"}
