"""The command `new`: models that come with the program, copied to be changed."""

from pathlib import Path

import pytest
from cli_runs import MODELS, code_of

from exudyn_flexlink.cli import main
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.scene import is_schema
from exudyn_flexlink.shipped import model_names
from exudyn_flexlink.source import load_document

SCHEMA = "flexlink.schema.json"


def names(folder="."):
    return sorted(path.name for path in Path(folder).iterdir())


def content(file):
    return Path(file).read_text(encoding="utf-8")


def test_without_arguments_it_copies_the_papers_mechanism(capsys):
    assert main(["new"]) == 0
    assert names() == [SCHEMA, "no_clearance.yaml"]
    assert content("no_clearance.yaml") == (MODELS / "no_clearance.yaml").read_text("utf-8")
    told = capsys.readouterr().out
    assert told.startswith("Written to no_clearance.yaml: Extensible flexible link on a double")
    assert "\n  exudyn-flexlink simulate no_clearance.yaml\n" in told


@pytest.mark.parametrize("name", model_names())
def test_each_model_is_copied_whole(name):
    """With its points and with the schema that its first line names; the copy is the same scene."""
    assert main(["new", name, "mine.yaml"]) == 0
    first = content("mine.yaml").splitlines()[0]
    assert first == f"# yaml-language-server: $schema={SCHEMA}"
    assert is_schema(content(SCHEMA))
    given = MODELS / f"{name}.yaml"
    assert load_document("mine.yaml").data == load_document(given).data
    if len(names()) > 2:  # points come along
        assert load_scene("mine.yaml") == load_scene(given)


def test_what_was_changed_is_replaced_only_by_force(capsys):
    assert main(["new"]) == 0
    assert main(["new"]) == 0  # nothing would be lost
    Path("no_clearance.yaml").write_text("mine", encoding="utf-8")
    assert main(["new"]) == 2
    assert "no_clearance.yaml: this program did not write" in capsys.readouterr().err
    assert content("no_clearance.yaml") == "mine"
    assert main(["new", "--force"]) == 0
    assert content("no_clearance.yaml") != "mine"


def test_points_of_the_user_stay_and_nothing_else_is_left(capsys):
    Path("track_points.csv").write_text("1, 2\n", encoding="utf-8")
    assert main(["new", "spline_track"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("can't write track_points.csv: ")
    assert told.endswith(
        "hint: 'spline_track' needs it beside itself; give a FILE in another folder\n"
    )
    assert names() == ["track_points.csv"]
    assert content("track_points.csv") == "1, 2\n"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["cleerance"], "no model 'cleerance' comes with the program; did you mean 'clearance'?"),
        (["rigid", "nowhere/mine.yaml"], "can't write nowhere/mine.yaml: there is no such folder"),
        (["rigid", "/dev/null"], "can't write /dev/null: it is a device"),
    ],
)
def test_what_can_not_be_copied_is_bad_input(arguments, told, capsys):
    assert code_of("new", *arguments) == 2
    assert told in capsys.readouterr().err
    assert names() == []


def test_the_list_has_every_model_and_fits_80_columns(capsys):
    assert main(["new", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    first = [line.split()[0] for line in lines if line[:2] == "  " and line[2] != " "]
    assert sorted(first) == model_names()
    assert names() == []


def test_a_name_means_the_model_of_the_program_and_that_is_said(capsys):
    """Who changed his copy, and forgets the suffix, must not take the other's numbers for his."""
    assert main(["new", "rigid"]) == 0
    assert main(["check", "rigid"]) == 0
    told = "hint: 'rigid' is the model that comes with the program, not your 'rigid.yaml'\n"
    assert capsys.readouterr().err == told
    assert main(["new", "whitworth", "mine.yaml"]) == 0
    assert code_of("check", "mine") == 2
    assert "did you mean 'mine.yaml'?" in capsys.readouterr().err
    assert code_of("simulate", "no_clearence") == 2
    told = capsys.readouterr().err
    assert "no file 'no_clearence', and no model of that name comes with the program" in told
    assert "did you mean 'no_clearance'?\nhint: 'exudyn-flexlink new --list' names all\n" in told
