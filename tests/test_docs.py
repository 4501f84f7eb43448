"""README and documentation: what they print is there, and their numbers come from scripts."""

import re
import runpy
import shlex
import sys
from pathlib import Path

import make_docs
import pytest
import reference
from pages_of_docs import DOCS, PAGES, PROGRAM, ROOT, blocks, commands, text_of
from written import parts_of, without_parts

import exudyn_flexlink as fl
from exudyn_flexlink.cli import program_parser
from exudyn_flexlink.cli.values import model_path
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import lever_response
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.source import parse_document

SCRIPTS = sorted((ROOT / "scripts").glob("*.py"))
TUTORIAL = sorted((DOCS / "tutorial").glob("*.yaml"))
IMAGE = re.compile(r"!\[[^]]*\]\((?P<file>[^)]+)\)")
MEASURED = re.compile(r"\d\.\d|\d[eE][-+]?\d")
LONGEST_README = 160  # lines
PLACES = ("exudyn_flexlink/", "models/", "scripts/", "tests/", "docs/", "curves/", "engines/",
          "mechanism/", "scene/")  # fmt: skip

any_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def of_program():
    """Arguments of the program in README, documentation and the help of its commands."""
    examples = "\n".join(reference.help_of(command) for command in reference.COMMANDS)
    told = re.findall(r"^  exudyn-flexlink (\w+ .*)$", examples, re.MULTILINE)
    return [words[1:] for _, words in commands() if words[0] == PROGRAM] + list(
        map(shlex.split, told)
    )


def of_scripts():
    """Scripts and their arguments in README, documentation and their own docstrings."""
    printed = [words[1:] for _, words in commands() if words[1:2] and "scripts/" in words[1]]
    usage = re.compile(r"^  \.venv/bin/python (scripts/\S+(?: \S+)*)", re.MULTILINE)
    told = [line for script in SCRIPTS for line in usage.findall(text_of(script))]
    return printed + [shlex.split(line.partition(" [")[0]) for line in told]


def test_the_readme_is_short():
    assert len(text_of(ROOT / "README.md").splitlines()) <= LONGEST_README


@pytest.mark.parametrize("arguments", of_program(), ids=" ".join)
def test_the_program_knows_the_arguments_of_each_command(arguments):
    options = vars(program_parser().parse_args(arguments))
    if "model" in options and not options.get("other"):
        path = ROOT / options["model"]
        given = path if path.exists() else model_path(str(options["model"]))
        load_scene(given, options.get("settings", ()))


@pytest.mark.parametrize("words", of_scripts(), ids=" ".join)
def test_the_scripts_know_the_arguments_of_each_command(words, monkeypatch, capsys):
    told = help_of(ROOT / words[0], words[1:], monkeypatch, capsys)
    for word in words[1:]:
        assert not word.startswith("--") or word in told


@pytest.mark.parametrize("item", make_docs.ITEMS, ids=lambda item: item.name)
def test_the_commands_that_make_the_documentation_are_known(item, monkeypatch, capsys):
    for command in (*item.commands, *([item.sample] if item.sample else [])):
        if command[0] == "-m":
            options = vars(program_parser().parse_args(command[2:]))
            assert "model" not in options or (ROOT / options["model"]).exists()
            continue
        told = help_of(ROOT / command[0], list(command[1:]), monkeypatch, capsys)
        assert all(word in told for word in command[1:] if word.startswith("--"))


def help_of(script, arguments, monkeypatch, capsys):  # fmt: skip
    """What a script prints that is asked for its usage after other arguments."""
    monkeypatch.setattr(sys, "argv", [str(script), *arguments, "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(script), run_name="__main__")
    shown = capsys.readouterr()
    assert ended.value.code == 0, shown.err
    return shown.out


def test_one_version_is_cited_and_built():
    cited = re.search(r"^version: (\S+)$", text_of(ROOT / "CITATION.cff"), re.MULTILINE)
    built = re.search(r'^version = "(\S+)"$', text_of(ROOT / "pyproject.toml"), re.MULTILINE)
    assert cited
    assert built
    assert cited[1] == built[1]


@any_page
def test_figures_are_made_by_a_script(page):
    made = {file for item in make_docs.ITEMS for file in item.figures}
    for file in IMAGE.findall(text_of(page)):
        path = (page.parent / file).resolve()
        assert path.exists()
        assert str(path.relative_to(DOCS)) in made


def test_no_figure_or_table_is_left_that_no_script_makes_or_no_page_shows():
    there = {path.name for ending in ("png", "gif") for path in DOCS.glob(f"*.{ending}")}
    assert there == {file for item in make_docs.ITEMS for file in item.figures}
    text = "\n".join(text_of(page) for page in PAGES)
    assert there == {Path(file).name for file in IMAGE.findall(text)}
    tables = {item.name for item in make_docs.ITEMS if item.page} | set(reference.texts())
    assert sorted(tables) == sorted(name for page in PAGES for name in parts_of(page))


@any_page
def test_a_clone_has_every_page_whole(page):
    """Nothing is read that a site's builder would have to put in, and no part is empty."""
    assert "include}" not in text_of(page)
    assert "eval-rst" not in text_of(page)
    assert all(len(text) > 200 for text in parts_of(page).values())


def test_no_page_is_stale():
    assert not reference.stale(), "run: python scripts/reference.py"


def test_a_page_that_differs_is_stale_and_another_part_is_left_alone(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    begin = "<!-- begin {0}, written by a script -->\n{1}\n<!-- end {0} -->\n"
    page.write_text(begin.format("keys", "old") + begin.format("other", "kept"))
    monkeypatch.setattr(reference, "DOCS", tmp_path)
    monkeypatch.setattr(reference, "texts", lambda: {"keys": "new"})
    assert reference.stale() == {page: begin.format("keys", "new") + begin.format("other", "kept")}


@any_page
def test_tables_of_numbers_are_written_by_scripts(page):
    for line in without_parts(page).splitlines():
        assert not (line.startswith("|") and MEASURED.search(line)), line


@any_page
def test_pages_teach_the_command_beside_which_no_file_stands_for_a_module(page):
    assert not any("-m exudyn_flexlink" in text for text in blocks(page, ""))


LEVERS = {
    "7 | penalty": ("no_clearance", "bodies.link.rods=7"),
    "3.2e+05 N/m": (
        "no_clearance",
        "contacts.strike.law.stiffness=3.2e5 N/m",
        "bodies.link.rods=5",
    ),
    "none, 'beam' hinges": ("no_clearance",),
}


@pytest.mark.parametrize("row", LEVERS)
def test_the_levers_least_angle_is_known_to_the_digits_that_a_table_prints(row):
    """By the engine that did not make the table, with nothing changed but what the row says."""
    lines = "\n".join(text for page in PAGES for text in parts_of(page).values()).splitlines()
    (line,) = (line for line in lines if line.startswith(f"| {row} |"))
    printed = re.search(r"(-0\.(\d+)) rad", line)
    model, *settings = LEVERS[row]
    settings += ["bodies.link.hinges.stiffness=beam", "run.turns=0.54", "accuracy.tolerance=1e-8"]
    result = simulate(load_scene(model_path(model), settings), "lagrangian")
    least, _ = lever_response(result, "strike").least
    assert least == pytest.approx(float(printed[1]), abs=0.51 * 10.0 ** -len(printed[2]))


def test_the_reference_says_how_many_rods_and_hinges_half_ends_make():
    settings = ["bodies.link.rods=4", "bodies.link.layout=half_ends"]
    model = build_mechanism(load_scene(model_path("no_clearance"), settings))
    hinges = [hinge for hinge in model.hinges if hinge.name.startswith("link")]
    assert (len(model.bodies["link"]), len(hinges)) == (5, 4)
    told = "number of rods; with layout half_ends of hinges, and one rod more"
    assert f"| `rods` | {told} |" in text_of(DOCS / "reference" / "model_file.md")


@any_page
def test_links_of_files_that_are_read_as_they_are_lead_somewhere(page):
    if page.parent == ROOT:  # Sphinx checks the others
        for target in re.findall(r"\]\(([^)#]+)\)", text_of(page)):
            assert target.startswith("https://") or (ROOT / target).exists(), target


@any_page
def test_files_that_are_named_are_there(page):
    for name in re.findall(r"`([\w/*.]+/[\w*.]*)(?: [^`]*)?`", text_of(page)):
        if name.startswith(PLACES):
            found = [*ROOT.glob(name), *(ROOT / "exudyn_flexlink").glob(name)]
            assert found, f"{page.name}: {name}"


@any_page
def test_python_is_python(page):
    for text in blocks(page, "python"):
        compile(text, str(page), "exec")


def test_the_model_of_the_readme_runs():
    (text,) = blocks(ROOT / "README.md", "yaml")
    scene = scene_of(parse_document(text, "README.md"), ["run.turns=0.1"])
    assert simulate(scene).outcome.completed


@pytest.mark.parametrize("path", TUTORIAL, ids=lambda path: path.stem)
def test_each_step_of_the_tutorial_runs(path):
    """With 2 rods for 10, with which the tests of the engines run the models of the paper."""
    scene, fewer = load_scene(path), ["bodies.link.rods=2"]
    flexible = scene.bodies["link"].type == "flexible" if "link" in scene.bodies else False
    settings = ["run.turns=0.6", *(fewer if flexible else [])]
    result = simulate(load_scene(path, settings), measure=False)
    assert result.outcome.completed
    if "clearance" not in path.stem:  # there a warning may tell of errors that touches multiply
        assert not result.warnings


@pytest.mark.parametrize(
    ("step", "model"), [("5_strike", "no_clearance"), ("6_clearance", "clearance")]
)
def test_the_tutorial_ends_at_the_models_of_the_paper(step, model):
    told, shipped = (
        load_scene(path).to_data()
        for path in (DOCS / "tutorial" / f"{step}.yaml", ROOT / "models" / f"{model}.yaml")
    )
    for data in (told, shipped):
        for key in ("title", "source", "accuracy"):
            del data[key]
        data["materials"]["steel"].pop("poissons_ratio", None)  # rods and hinges need none
    assert told == shipped


def test_the_reference_has_every_key():
    text = "\n".join(reference.model_file())
    schema = json_schema()
    headings = re.findall(r"^##+ (.*)$", text, re.MULTILINE)
    targets = [re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in headings]
    for part in (schema, *schema["$defs"].values()):
        for key in part["properties"]:
            assert f"| `{key}` | " in text
    for name in schema["$defs"]:
        assert targets.count(reference.anchor(name, schema["$defs"])) == 1
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert [row for row in rows if not row.endswith(" |")] == []  # one line each
    assert "usage: exudyn-flexlink simulate" in "\n".join(reference.commands())
    python = "\n".join(reference.python())
    told = set(re.findall(r"^### `(\w+)`", python, re.MULTILINE))
    assert set(fl.__all__) - told == {"Simulate", "__version__"}  # neither class nor function


@pytest.mark.parametrize("path", reference.EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_of_the_reference_are_models(path):
    load_scene(path)


def test_the_examples_of_the_reference_show_every_type_and_key():
    """A new part of the language needs its example in docs/reference/examples."""
    missing = [
        f"{name}.{key}"
        for name, part in json_schema()["$defs"].items()
        for key in part["properties"]
        if reference.example_of(name, key) == "none" and not optional_type(part, key)
    ]
    assert not missing


def optional_type(part, key):
    """A type that may be left out, since there is only one, or one that is meant then."""
    return key == "type" and key not in part.get("required", ())


def test_every_key_says_what_it_is():
    for part in json_schema()["$defs"].values():
        for key, value in part["properties"].items():
            assert len(value["description"]) > 3, (part, key)


@pytest.mark.parametrize(
    "item", [item for item in make_docs.ITEMS if item.sample], ids=lambda item: item.name
)
def test_tables_hold_what_is_measured_now(item):
    assert not make_docs.check(item), f"run: python scripts/make_docs.py {item.name}"


@pytest.mark.parametrize(
    ("row", "other", "same"),
    [
        ("| a | 1.0e-07 (9, 0.1 s) |", "| a | 2.0e-07 (11, 7.5 s) |", True),  # times aside
        ("| a | 1.0e-07 |", "| a | 4.0e-07 |", False),
        ("| a | 1.0e-15 |", "| a | 9.0e-13 |", True),  # rounding
        ("| a | -1 |", "| a | 1 |", False),
        ("| a, 10 | 1 |", "| a, 20 | 1 |", False),  # another row
        ("| a | right |", "| a | wrong |", False),
    ],
)
def test_rows_agree_but_for_noise(row, other, same):
    assert make_docs.agree(row, other) is same
