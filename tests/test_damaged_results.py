"""Saved runs whose files are not what was written."""

import json
import shutil
from pathlib import Path

import pytest
import results

from exudyn_flexlink import storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.storage.replacing import FORMAT
from exudyn_flexlink.storage.run import write_netcdf


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    storage.save(results.rigid_link(samples=101), folder / "rigid")
    return folder


@pytest.fixture(autouse=True)
def run(saved, monkeypatch):
    """A copy of a run with events and contacts."""
    shutil.copytree(saved / "rigid", "rigid")
    # Whatever is drawn after all is nonsense.
    monkeypatch.setattr("exudyn_flexlink.plots.save_figures", None)


def refused(capsys, file, why="is damaged"):
    """What `plot` says of a damaged run: one sentence, with the name of the file."""
    assert main(["plot", "rigid"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"{Path('rigid', file)} {why}")
    assert said.err.count("\n") == 1
    assert not list(Path("rigid").glob("*.png"))
    return said.err


@pytest.mark.parametrize("part", [0.0, 0.001, 0.3, 0.999])
def test_truncated_arrays(part, capsys):
    file = Path("rigid/result.nc")
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    refused(capsys, "result.nc")


def test_no_memory_for_the_arrays(capsys, monkeypatch):
    def read(file):
        raise MemoryError("Unable to allocate 728. TiB")

    monkeypatch.setattr("exudyn_flexlink.storage.run.read_netcdf", read)
    refused(capsys, "result.nc", "is too large for this machine: Unable to allocate")


def test_an_array_that_was_changed_since(capsys):
    """A flipped byte of a number leaves a number: the SHA-256 in the file tells."""
    file = Path("rigid/result.nc")
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    assert "not what was written" in refused(capsys, "result.nc")


def test_a_run_of_an_earlier_version(capsys):
    told = {"format": FORMAT - 1, "versions": {"exudyn-flexlink": "0.0.9"}, "as": "it was then"}
    write_netcdf(Path("rigid/result.nc"), {}, {"run": json.dumps(told)})
    assert main(["plot", "rigid"]) == 2
    assert capsys.readouterr().err == (
        "rigid/result.nc was written by another version, exudyn-flexlink 0.0.9 with format "
        f"{FORMAT - 1}; run the model again\n"
    )
    with storage.staged_folder(Path("rigid"), force=True) as folder:
        storage.save(results.pendulum(), folder)
    assert storage.load(Path("rigid")).scene.title == "pendulum"
