"""Links, devices and pipes are neither replaced nor waited for."""

import os
from pathlib import Path

import pytest
import results
from cli_runs import NO_CLEARANCE, SPLINE
from folders import posix, simulate, tree

from exudyn_flexlink.cli import main
from exudyn_flexlink.storage import load


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
