"""The command `sweep`: study files, bad input, folders, interrupts, figures."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
from results import PENDULUM, rigid_link

from exudyn_flexlink.cli import main
from exudyn_flexlink.result import Outcome
from exudyn_flexlink.storage import load_sweep
from exudyn_flexlink.sweeps import read_study

DOCS = Path(__file__).parents[1] / "docs"
LENGTH = "bodies.rod.length"
SWEEP = ["sweep", "model.yaml", "--over", f"{LENGTH}=1:3:3", "--workers", "1", "--out", "out"]
STUDY = """\
model: model.yaml
set: [run.duration=2]
grid:
  bodies.rod.length: 100:300:3 mm
  gravity: [[0, -9.81], [0, -1.62]]
"""


@pytest.fixture(autouse=True)
def closed_form(monkeypatch, tmp_path):
    """Put closed form in place of an engine; runs of one length may fail."""
    (tmp_path / "model.yaml").write_text(PENDULUM)
    failing = [-1.0]

    def simulate(scene, engine="exudyn", **_):
        length = scene.bodies["rod"].length
        made = replace(rigid_link(samples=101), engine=engine)
        stopped = Outcome(False, 0.5, "no convergence")
        return replace(made, outcome=stopped) if length in failing else made

    monkeypatch.setattr("exudyn_flexlink.engines.simulate", simulate)
    return failing.append


def table():
    with Path("out/table.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(("values", "told"), [("1-3", True), ("1:3:2", False), ("1, 3", False)])
def test_a_range_written_as_a_difference_is_told(values, told, capsys):
    main(
        ["sweep", "model.yaml", "--over", f"run.duration={values}", "--workers", "1", "--no-plots"]
    )
    assert (f"run.duration has one value, '{values}'" in capsys.readouterr().err) == told


def test_a_sweep_writes_its_table_and_tells_of_it(capsys):
    assert main([*SWEEP, "--no-plots"]) == 0
    assert [row[f"{LENGTH}_m"] for row in table()] == ["1", "2", "3"]
    assert "rows       3 of 3" in capsys.readouterr().out
    columns = load_sweep(Path("out")).columns()
    assert list(columns) == list(table()[0])
    read = [float(row["lever.swing_rad"]) for row in table()]
    assert read == pytest.approx(columns["lever.swing_rad"])


def test_a_study_file_says_what_varies():
    Path("study.yaml").write_text(STUDY)
    assert main(["sweep", "study.yaml", "--workers", "1", "--out", "out", "--no-plots"]) == 0
    assert [row[f"{LENGTH}_m"] for row in table()] == ["0.1", "0.1", "0.2", "0.2", "0.3", "0.3"]
    assert table()[1]["gravity"] == "[0, -1.62]"
    assert json.loads(Path("out/sweep.json").read_text())["scene"]["run"]["duration"] == 2


def test_the_study_of_the_documentation_can_be_read():
    study = read_study(DOCS / "study.yaml")
    assert study.design is not None
    assert (len(study.design.points), study.mistakes) == (40, ())


BAD_STUDIES = {
    "unknown key": (STUDY.replace("set:", "sett:"), ["study.yaml:2:1", "did you mean 'set'?"]),
    "two designs": (STUDY + "list: []\n", ["study.yaml:6:7", "exclude each other"]),
    "no design": ("model: model.yaml\n", ["needs 'grid' or 'list' or 'latin_hypercube'"]),
    "values": (
        STUDY.replace("100:300:3 mm", "[1, 2 kg]").replace("-1.62", "-1 N").replace("gra", "gar"),
        ["study.yaml:4:26: grid.bodies.rod.length.1", "expected a length, got '2 kg'",
         "study.yaml:5:", "unknown key 'garvity'; did you mean 'gravity'?"],
    ),
    "setting": (STUDY.replace("run.duration", "run.durration"), ["study.yaml:2:7: set.0",
                                                                "did you mean 'duration'?"]),
    "missing model": (STUDY.replace("model.yaml", "modell.yaml"), ["study.yaml:1:8: model"]),
    "no count": ("model: model.yaml\nrandom: {ranges: {gravity: '1:2'}}\n",
                 ["study.yaml:2:1: random: missing 'count'"]),
}  # fmt: skip


@pytest.mark.parametrize(("text", "words"), BAD_STUDIES.values(), ids=BAD_STUDIES)
def test_mistakes_of_a_study_are_shown_where_they_stand(text, words, capsys):
    Path("study.yaml").write_text(text)
    assert main(["sweep", "study.yaml", "--out", "out"]) == 2
    told = capsys.readouterr().err
    assert all(word in told for word in words), told
    assert "Traceback" not in told
    assert not Path("out").exists()


BAD_OPTIONS = {
    "--over gravity": "expected path=values",
    "--over gravity=1:2:3 --over gravity=1": "gravity: is varied twice",
    "--over gravity=1:2": "expected start:stop:count",
    "--over gravty=1": "did you mean 'gravity'?",
    "--over bodies.rod.length=0mm:1:3m": "the range has the units 'm' and 'mm'",
    "--over gravity=1 --scheduler tcp://h:1 --workers 2": "a scheduler has its own workers",
    "--set run.duration=2": "this is a model, no study",
}


@pytest.mark.parametrize(("options", "words"), BAD_OPTIONS.items(), ids=BAD_OPTIONS)
def test_bad_options_are_told_and_nothing_is_written(options, words, capsys):
    assert main(["sweep", "model.yaml", *options.split(), "--out", "out"]) == 2
    assert words in capsys.readouterr().err
    assert not Path("out").exists()


def test_the_same_command_again_says_how_to_go_on(capsys):
    main([*SWEEP, "--no-plots", "--quiet"])
    journal = Path("out/journal.jsonl")
    journal.write_text("".join(journal.read_text().splitlines(keepends=True)[:2]))
    assert main([*SWEEP, "--no-plots"]) == 2
    assert "2 of the 3 rows of this very sweep; resume it" in capsys.readouterr().err
    assert main([*SWEEP, "--no-plots", "--resume"]) == 0
    assert "2 of 3 rows are there; going on with the rest" in capsys.readouterr().err
    assert [row["run"] for row in table()] == ["1", "2", "3"]
    assert main([*SWEEP, "--no-plots", "--resume"]) == 0
    assert "3 of 3 rows are there; none is missing" in capsys.readouterr().err
    journal.write_text("")  # without rows there is nothing to go on with
    assert main([*SWEEP, "--no-plots", "--quiet"]) == 0
    assert [row["run"] for row in table()] == ["1", "2", "3"]


DAMAGES = {
    "'number' can't be read": ('"number":2', '"number":"two"'),
    "'numbers.end_s' can't be read": ('"end_s":', '"end_s":[],"more":'),
    "'status' is missing": ('"status"', '"state"'),
    "it is no JSON": ('{"number":2', "{number:2"),
    "it is no row of a sweep": (None, "7"),
}


@pytest.mark.parametrize("why", DAMAGES)
def test_a_damaged_journal_is_told(why, capsys):
    """By file and line, in the program's words, and with what mends it."""
    main([*SWEEP, "--no-plots", "--quiet"])
    journal, (old, new) = Path("out/journal.jsonl"), DAMAGES[why]
    lines = journal.read_text().splitlines(keepends=True)
    damaged = f"{new}\n" if old is None else lines[1].replace(old, new)
    assert damaged != lines[1]
    journal.write_text("".join([lines[0], damaged, lines[2]]))
    told = (
        f"out/journal.jsonl:2: this line is damaged: {why}; delete it, and '--resume' makes its "
        "run again\n"
    )
    capsys.readouterr()
    assert main([*SWEEP, "--no-plots", "--resume"]) == 2
    assert capsys.readouterr().err == told
    assert main(["plot", "out"]) == 2
    assert capsys.readouterr().err == told
    journal.write_text("".join([lines[0], lines[2]]))
    assert main([*SWEEP, "--no-plots", "--resume", "--quiet"]) == 0
    assert [row["run"] for row in table()] == ["1", "2", "3"]


@pytest.mark.parametrize("more", [[], ["--resume"]])
def test_rows_without_their_plan_are_told_and_kept(more, capsys):
    main([*SWEEP, "--no-plots", "--quiet"])
    Path("out/sweep.json").unlink()
    capsys.readouterr()
    assert main([*SWEEP, "--no-plots", "--quiet", *more]) == 2
    told = "out has a journal.jsonl, but no sweep.json that tells of which sweep"
    assert capsys.readouterr().err.startswith(told)
    assert Path("out/journal.jsonl").read_text().count("\n") == 3
    assert main([*SWEEP, "--no-plots", "--quiet", "--force"]) == 0
    assert len(table()) == 3


def test_another_sweep_is_not_written_into_the_same_folder(capsys):
    main([*SWEEP, "--no-plots", "--quiet"])
    other = [*SWEEP[:3], f"{LENGTH}=1:4:4", *SWEEP[4:], "--no-plots", "--quiet"]
    assert main([*other, "--resume"]) == 2
    assert "another sweep, of other points" in capsys.readouterr().err
    assert main([*other, "--force"]) == 0
    assert len(table()) == 4
    assert len(load_sweep(Path("out")).rows) == 4


def test_ctrl_c_keeps_the_rows_that_are_there(monkeypatch, capsys):
    made = []

    def twice(scene, engine="exudyn", **_):
        made.append(scene)
        if len(made) == 3:
            raise KeyboardInterrupt
        return rigid_link(samples=101)

    monkeypatch.setattr("exudyn_flexlink.engines.simulate", twice)
    assert main([*SWEEP, "--no-plots"]) == 130
    assert "interrupted: 2 of 3 rows are in out/" in capsys.readouterr().err
    assert [row["run"] for row in table()] == ["1", "2"]
    assert main([*SWEEP, "--no-plots", "--resume", "--quiet"]) == 0
    assert [row["run"] for row in table()] == ["1", "2", "3"]
    assert len(made) == 4


def test_a_failed_run_does_not_fail_the_sweep_but_all_of_them_do(closed_form, capsys):
    closed_form(2.0)
    assert main([*SWEEP, "--no-plots"]) == 0
    out = capsys.readouterr().out
    assert "3 of 3, 1 failed" in out
    assert "stopped at t = 0.5 s: no convergence" in out
    assert [row["status"] for row in table()] == ["doubtful", "failed", "doubtful"]
    assert main(["sweep", "model.yaml", "--over", f"{LENGTH}=2", "--workers", "1", "--out", "2",
                 "--no-plots"]) == 1  # fmt: skip


@pytest.mark.parametrize("varied", [1, 2, 3])
def test_a_sweep_is_drawn_over_any_number_of_values(varied, closed_form, capsys):
    closed_form(2.0)
    more = ["--over", "gravity=1, 2"] * (varied > 1) + ["--over", "run.duration=1, 2"] * (
        varied > 2
    )
    assert main([*SWEEP, *more, "--quiet", "--no-measure"]) == 0
    chosen = "lever.swing_rad,end_s"
    assert main(["plot", "out", "--of", chosen, "--style", "print", "--format", "svg"]) == 0
    drawn = Path("out/sweep.svg").read_text()
    assert "failed" in drawn
    assert main(["plot", "out", "--of", "lever.swin_rad"]) == 2
    assert "did you mean 'lever.swing_rad'?" in capsys.readouterr().err
