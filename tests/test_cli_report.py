"""The command `report`, and `simulate --report`: where pages go, and what they never replace."""

import json
from pathlib import Path

import pytest
from cli_runs import NO_CLEARANCE
from pages import read_page
from results import put, rigid_link

import exudyn_flexlink as fl
from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.cli import main
from exudyn_flexlink.page import PAGE, is_page, page_of
from exudyn_flexlink.storage import StorageError, written_files

SIMULATE = ["simulate", NO_CLEARANCE, "--no-plots", "--quiet", "--out", "here", "--report"]


@pytest.fixture(autouse=True)
def without_figures(monkeypatch):
    """Leave out the figures of pages, which take seconds."""
    monkeypatch.setattr("exudyn_flexlink.page.pictures_of", lambda _: {})


@pytest.fixture
def saved():
    """Return the folder of a run, in the folder that the program is called in."""
    put(rigid_link(turns=1, samples=401), "run")
    return Path("run")


def closed_form(scene, engine="exudyn", progress=None):
    return rigid_link(scene=scene, samples=401)


def page_in(folder):
    return (Path(folder) / PAGE).read_text(encoding="utf-8")


# --- report -----------------------------------------------------------------------------------


def test_a_page_is_put_beside_its_run(saved, capsys):
    assert main(["report", "run"]) == 0
    assert capsys.readouterr().out == f"Report written to {saved / PAGE}\n"
    read_page(page_in(saved))
    assert PAGE in written_files(saved)
    assert "result.nc" in written_files(saved)
    assert main(["report", "run"]) == 0  # its own is replaced


def test_the_page_of_a_saved_run_is_that_of_the_run_itself(saved):
    main(["report", "run"])
    assert page_in(saved) == page_of(rigid_link(turns=1, samples=401))


@pytest.mark.parametrize("out", [[], ["--out", "run/report.html"]], ids=["beside", "by name"])
def test_a_file_of_the_user_is_replaced_only_by_force(saved, out, capsys):
    (saved / PAGE).write_text("<p>my notes</p>")
    assert main(["report", "run", *out]) == 2
    assert "--force" in capsys.readouterr().err
    assert page_in(saved) == "<p>my notes</p>"
    assert main(["report", "run", *out, "--force"]) == 0
    assert is_page(page_in(saved).encode())


def test_what_is_no_run_has_no_report(saved, capsys):
    Path("empty").mkdir()
    for folder in ("empty", "nowhere"):
        assert main(["report", folder]) == 2
        assert "Traceback" not in capsys.readouterr().err
    assert list(Path("empty").iterdir()) == []


# --- simulate --report ------------------------------------------------------------------------


def test_a_run_brings_its_page(run_of, capsys):
    run_of(closed_form)
    assert main([one for one in SIMULATE if one != "--quiet"]) == 0
    assert PAGE in capsys.readouterr().out
    assert "made up" in read_page(page_in("here")).words  # the warning of that run
    assert PAGE in json.loads(Path("here/manifest.json").read_text())["files"]
    assert not list(Path("here").glob("*.png"))


def test_a_run_without_a_page_leaves_none_of_an_earlier_one(run_of):
    run_of(closed_form)
    main(SIMULATE)
    assert main(SIMULATE[:-1]) == 0
    assert not Path("here", PAGE).exists()


@pytest.mark.parametrize(
    "failure",
    [
        (ValueError("a mistake"), 1, "no report: ValueError: a mistake; the numbers are kept"),
        (MemoryError(), 1, "no report: not enough memory"),
        (KeyboardInterrupt(), 130, "interrupted: the run is whole"),
    ],
)
def test_no_failure_of_a_page_costs_the_run(failure, run_of, monkeypatch, capsys):
    run_of(closed_form)
    error, code, told = failure

    def fail(_):
        raise error

    monkeypatch.setattr("exudyn_flexlink.page.page_of", fail)
    assert main(SIMULATE) == code
    assert told in capsys.readouterr().err
    assert {path.name for path in Path("here").iterdir()} >= {"result.nc", "summary.json"}
    assert not Path("here", PAGE).exists()


# --- Python -----------------------------------------------------------------------------------


def test_a_result_writes_its_page(tmp_path):
    result = api_result(rigid_link(turns=1, samples=401))
    path = result.report(tmp_path / "a.html")
    assert path.read_text(encoding="utf-8") == page_of(result)
    result.report(path)
    path.write_text("mine")
    with pytest.raises(fl.StorageError, match="did not write"):
        result.report(path)
    with pytest.raises(StorageError, match="no such folder"):
        result.report(tmp_path / "nowhere" / "a.html")
    result.report(path, force=True)
    assert is_page(path.read_bytes())
