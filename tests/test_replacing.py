"""A run replaces the files that a run wrote, and nothing of the user's."""

import json
import os
from pathlib import Path

import pytest
import results
from cli_runs import NO_CLEARANCE, SPLINE
from folders import mine, posix, simulate, tree
from results import rigid_link

import exudyn_flexlink as fl
from exudyn_flexlink import engines, storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.storage import (
    KeptBesideError,
    StorageError,
    load,
    staged_folder,
    written_files,
)

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
    assert set(written_files(Path("o"))) == written


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
    assert "no manifest.json names them; choose another name, or force it" in said
    assert said.endswith("hint: '--force' forces it\n")
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
        "force it\nhint: '--force' forces it\n"
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


@pytest.mark.parametrize("name", ["../mine", "/mine", "..", "a/../../mine"])
def test_a_manifest_names_nothing_outside_its_folder(name):
    results.put(results.pendulum(), "o")
    mine("mine")
    manifest = json.loads(Path("o/manifest.json").read_text(encoding="utf-8"))
    manifest["files"][name] = storage.replacing.digest(Path("mine"))
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
    assert said.err.endswith(
        f"unless that is forced. What was computed is in {place}-2\nhint: '--force' forces it\n"
    )
    assert f"Written to {place}-2/:\n  " in said.out
    folder = Path("o-2") if command == "simulate" else Path("o-2/exudyn")
    assert not load(folder).outcome.completed
    assert main([*again, "--force"]) == code
    assert tree("o") != before
    ends(True)
    assert main(again) == 0  # a complete one replaces an incomplete one
    assert sorted(path.name for path in Path().iterdir()) == ["o", "o-2"]


# --- names, figures, schemas --------------------------------------------------------------------


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


# --- links, devices and pipes ---------------------------------------------------------------------


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
def test_models_and_points_are_not_read_from_pipes_and_devices(capsys):
    os.mkfifo("model.yaml")
    for model in ("model.yaml", "/dev/null"):
        assert main(["check", model]) == 2
        assert f"{model}: not a file but a pipe or a device" in capsys.readouterr().err
    os.mkfifo("points.csv")
    text = Path(SPLINE).read_text(encoding="utf-8").replace("track_points.csv", "points.csv")
    Path("track.yaml").write_text(text, encoding="utf-8")
    assert main(["check", "track.yaml"]) == 2
    said = capsys.readouterr().err
    assert "track.yaml:13:31: curves.track.file: 'points.csv' is a pipe or a device" in said


@posix
@pytest.mark.parametrize("name", ["result.nc", "manifest.json"])
def test_a_link_where_a_file_is_written_first_is_not_followed(name):
    mine("elsewhere")
    Path("o").mkdir()
    Path("o", f".flexlink-{name}").symlink_to(Path("elsewhere").resolve())
    results.put(results.pendulum(), "o")
    assert load(Path("o")).scene.title == "pendulum"
    assert tree()["elsewhere"] == b"mine"
    assert not list(Path("o").glob(".flexlink-*"))


@pytest.mark.parametrize("what", ["simulate", "sweep"])
def test_a_place_below_2000_folders_is_refused_in_a_sentence(what, capsys):
    Path("model.yaml").write_text(results.PENDULUM.replace("duration: 1", "duration: 0.01"))
    over = ["--over=bodies.rod.length=1,2", "--workers=1"] * (what == "sweep")
    assert main([what, "model.yaml", *over, "--no-plots", "--out", "d/" * 2000]) == 2
    assert "too many folders in each other; choose another place\n" in capsys.readouterr().err
    with pytest.raises(StorageError, match="too many folders"):
        fl.simulate(fl.load_scene("model.yaml")).save("./" + "d/" * 2000)
    assert not Path("d").exists()


@posix
@pytest.mark.parametrize("name", ["journal.jsonl", "series"])
@pytest.mark.parametrize("more", [["--resume"], ["--force"]])
def test_a_sweep_writes_through_no_link(name, more, capsys):
    Path("model.yaml").write_text(results.PENDULUM.replace("duration: 1", "duration: 0.01"))
    command = ["sweep", "model.yaml", "--over=bodies.rod.length=1,2", "--workers=1", "--out=o",
               "--series", "--no-plots", "--quiet"]  # fmt: skip
    assert main(command) == 0
    Path("o", name).rename("elsewhere")
    Path("o", name).symlink_to(Path("elsewhere").resolve())
    before = {k: v for k, v in tree().items() if k.startswith("elsewhere")}
    capsys.readouterr()
    code = main([*command, *more])
    if (name, more) == ("journal.jsonl", ["--force"]):  # it is begun anew, in a file of its own
        assert code == 0
    else:
        assert code == 2
        assert f"{name} is a link" in capsys.readouterr().err
    assert {k: v for k, v in tree().items() if k.startswith("elsewhere")} == before
