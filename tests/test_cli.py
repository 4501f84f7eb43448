"""The program at a terminal: what it imports, bad input, help, schema."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from cli_runs import BARE, COMMANDS, MODELS, NO_CLEARANCE, RIGID, SPLINE, code_of, python

import exudyn_flexlink as fl
from exudyn_flexlink import cli
from exudyn_flexlink.cli import main
from exudyn_flexlink.cli.arguments import SHELLS
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.shipped import model_names

# --- what is not imported -------------------------------------------------------------------


def test_what_solves_nothing_imports_nothing_slow(tmp_path):
    code = (
        "import sys; from exudyn_flexlink.cli import main\n"
        "for line in sys.argv[1:]:\n"
        "    main(line.split('|'))\n"
        "    slow = {'scipy', 'matplotlib', 'exudyn', 'rich'} & set(sys.modules)\n"
        "    assert not slow, (line, slow)"
    )
    lines = [f"check|{NO_CLEARANCE}", f"check|{RIGID}", f"new|rigid|{tmp_path / 'mine.yaml'}"]
    ran = python("-c", code, *lines)
    assert ran.stderr == ""
    assert all(line.split("|")[1] in ran.stdout for line in lines)


def test_help_imports_not_even_numpy():
    code = (
        "import sys, exudyn_flexlink.cli as cli; cli.program_parser().format_help();"
        "print(*{'numpy', 'pydantic', 'yaml'} & set(sys.modules))"
    )
    assert python("-c", code).stdout.strip() == ""


def test_ctrl_c_while_the_program_is_read_is_no_traceback():
    code = (
        "import runpy, sys\n"
        "class Interrupted:\n"
        "    def find_spec(name, *_):\n"
        "        if name == 'exudyn_flexlink.cli': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupted)\n"
        "runpy.run_module('exudyn_flexlink', run_name='__main__')"
    )
    ran = python("-c", code)
    assert (ran.returncode, ran.stdout, ran.stderr) == (130, "", "")


# --- bad input ------------------------------------------------------------------------------


def test_without_a_command_the_help_is_shown(capsys):
    assert code_of("--version") == 0
    assert capsys.readouterr().out.startswith("exudyn-flexlink")
    assert main([]) == 2
    said = capsys.readouterr().err
    assert "simulate  simulate a model, save its results and draw its figures" in said
    assert "first steps:\n  exudyn-flexlink simulate no_clearance\n" in said


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_a_mistake_is_shown_where_it_stands(command, tmp_path, capsys):
    model = tmp_path / "wrong.yaml"
    text = Path(NO_CLEARANCE).read_text(encoding="utf-8")
    model.write_text(text.replace("clearance: 0", "clearance: 5 N"), encoding="utf-8")
    assert main([command, str(model)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith(f"{model}:36:")
    assert "joints.sleeve.clearance: expected a length, got '5 N'" in shown.err
    assert "^^^" in shown.err
    assert "Traceback" not in shown.err
    assert not Path("runs/wrong").exists()


@pytest.mark.parametrize("command", ["check", "simulate", "accuracy"])
def test_a_missing_model_is_named(command, capsys):
    assert main([command, "models/nowhere.yaml"]) == 2
    assert capsys.readouterr().err.startswith(
        "models/nowhere.yaml: can't read the file: No such file"
    )


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["dance"], "--help' tells what it takes"),
        (["check"], "--help' tells what it takes"),
        (["check", RIGID, "--plots"], "--help' tells what it takes"),
        (["check", ""], "MODEL: expected a file, or the name of a model; got nothing"),
        (["check", RIGID, "--set", "run.turs=2"], "--set run.turs=2: run.turs: unknown key 'turs'"),
        (["check", RIGID, "--set", "foo.bar=1"], "--set foo.bar=1: foo: unknown key 'foo'\n"),
        (["schema", "--out", "nowhere/schema.json"], "can't write nowhere"),
    ],
)
def test_wrong_arguments_are_bad_input(arguments, told, capsys):
    assert code_of(*arguments) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize("word", ["--witout", "--witout=friction"])
def test_an_unknown_option_is_told_with_a_near_one_of_its_command(word, capsys):
    assert code_of("compare", RIGID, word, "friction") == 2
    assert capsys.readouterr().err == (
        f"exudyn-flexlink compare: unknown argument '{word}'; did you mean '--without'?\n"
        "hint: 'exudyn-flexlink compare --help' tells what it takes\n"
    )


@pytest.mark.parametrize(
    ("command", "option", "expected"),
    [
        *(("compare", f"--tolerance={x}", "a length of") for x in ("0", "-1", "nan", "inf")),
        *(("accuracy", f"--budget={x}", "a time of more than 0") for x in ("-3", "x")),
        ("accuracy", "--target=inf", "a length of more than 0"),
        ("stability", "--laps=-1", "a whole number from 0"),
        ("stability", "--lap=0", "a time of more than 0"),
        ("stability", "--at=nan", "an angle, such as 90"),
    ],
)
def test_a_number_that_an_option_can_not_be_is_told(command, option, expected, capsys):
    assert code_of(command, RIGID, option) == 2
    assert f"argument {option.split('=')[0]}: expected {expected}" in capsys.readouterr().err


def test_files_outside_the_models_folder_need_leave(tmp_path, capsys):
    model = tmp_path / "inner" / "model.yaml"
    model.parent.mkdir()
    text = Path(SPLINE).read_text(encoding="utf-8").replace("track_points", "../track_points")
    model.write_text(text, encoding="utf-8")
    (tmp_path / "track_points.csv").write_text((MODELS / "track_points.csv").read_text())
    assert main(["check", str(model)]) == 2
    assert "the file must be in the model's folder" in capsys.readouterr().err
    assert main(["check", str(model), "--allow-outside"]) == 0


# --- help, version, schema ------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_help_gives_examples_that_parse(command, capsys):
    assert code_of(command, "--help") == 0
    shown = capsys.readouterr().out
    lines = [line.split() for line in shown.split("examples:\n")[1].splitlines()]
    assert 2 <= len(lines) <= 5
    for line in lines:
        assert line[:2] == ["exudyn-flexlink", command]
        cli.program_parser().parse_args(line[1:])


def test_schema_is_printed_or_written(tmp_path, capsys):
    assert main(["schema"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed) == json_schema()
    assert main(["schema", "--out", str(tmp_path / "schema.json")]) == 0
    assert (tmp_path / "schema.json").read_text(encoding="utf-8") == printed


# --- completion by shells -------------------------------------------------------------------------

LINES = [
    (["si"], {"simulate"}),
    (["simulate", "clear"], {"clearance", "clearance_friction"}),
    (["check", "mi"], {"mine.yaml"}),
    (["check", "no_"], {"no_clearance", "no_mine.yaml"}),
    (["new", "textbook/do"], {"textbook/double_pendulum"}),
    (["new", "no_"], {"no_clearance"}),
    (["new", "rigid", "mi"], {"mine.yaml"}),
    (["simulate", "rigid", "--engine", ""], {"exudyn", "lagrangian"}),
    (["simulate", "rigid", "--no-m"], {"--no-measure"}),
    (["plot", ""], {"runs"}),
    (["completion", ""], set(SHELLS)),
]
ASK = """
source "$1"; shift
words=("$@")
COMP_WORDS=("$@") COMP_CWORD=$((${#words[@]} - 1)) COMPREPLY=()
offers=$(complete -p exudyn-flexlink | sed 's/.*-F \\([^ ]*\\).*/\\1/')
"$offers" exudyn-flexlink "${words[COMP_CWORD]}" 2> /dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture
def script(capsys):
    """Return bash's script, in a folder with some files of a user."""
    Path("runs").mkdir()
    for name in ("mine.yaml", "no_mine.yaml"):
        Path(name).touch()
    assert main(["completion", "bash"]) == 0
    Path("./completion.sh").write_text(capsys.readouterr().out, encoding="utf-8")
    return Path("./completion.sh")


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(("words", "offered"), LINES, ids=[" ".join(words) for words, _ in LINES])
def test_bash_offers(words, offered, script):
    ran = subprocess.run(
        ["bash", "-c", ASK, "bash", f"./{script}", "exudyn-flexlink", *words],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert set(ran.stdout.split()) == offered


def test_zsh_knows_every_command_and_model(capsys):
    assert main(["completion", "zsh"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("#compdef exudyn-flexlink\n")
    assert all(name in told for name in (*model_names(), "simulate", "--watch"))


def test_another_shell_is_bad_input(capsys):
    assert code_of("completion", "csh") == 2
    assert "bash" in capsys.readouterr().err


# --- what users type at first -------------------------------------------------------------------

MEANT = {
    "link.yaml": "argument COMMAND: no 'link.yaml'; did you mean 'simulate link.yaml'? There is: ",
    "simulat rigid": "argument COMMAND: no 'simulat'; did you mean 'simulate'?",
    "bogus": "no 'bogus'; there is: simulate, compare, ",
    "simulate rigid --engine exudin": "no 'exudin'; did you mean 'exudyn'?",
    "simulate rigid --without fricton": "there is no effect 'fricton'; did you mean 'friction'?",
    "simulate rigid --tolerance 1e-6": "it is a value of the model: '--set accuracy.tolerance=...'",
    "sweep rigid --vary gravity=1,2": "of a sweep it is '--over PATH=VALUES'",
    "sweep rigid --ovr gravity=1,2": "did you mean '--over'?",
    "sweep rigid --over drives.motor.value=6:14:9 rad/s": "'drives.motor.value=6:14:9 rad/s'",
    "check rigid --over x": "unknown argument '--over'\n",  # not '--force'
    "compare rigid --without clearance": "hint: Exudyn compares this model '--without impact'",
    "compare slider_crank_flexible": "hint: refused by the engine 'lagrangian'; Exudyn compares "
    "this model '--without flexibility' or '--without damping'\n",
}


@pytest.mark.parametrize(("typed", "told"), MEANT.items(), ids=MEANT)
def test_what_was_meant_is_told(typed, told, capsys):
    assert code_of(*typed.split()) == 2
    assert told in capsys.readouterr().err


def test_files_beside_the_model_stand_for_no_module_of_python():
    for name in ("random", "yaml", "numpy"):
        Path(f"{name}.py").write_text("raise SystemExit('a foreign module')\n")
    shutil.copyfile(RIGID, "model.yaml")
    over = ["--over", "drives.motor.value=5,6 rad/s", "--workers", "2", "--set=run.turns=0.02"]
    quiet = ["--no-plots", "--quiet"]
    ended = subprocess.run(
        [sys.executable, "-m", "exudyn_flexlink", "sweep", "model.yaml", *over, *quiet],
        env=BARE, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (0, "")


def test_a_folder_named_like_a_model_is_no_model(capsys):
    Path("clearance").mkdir()
    assert code_of("check", "clearance") == 0
    assert "no mistakes" in capsys.readouterr().out
    assert fl.load_scene("clearance") == fl.load_scene(MODELS / "clearance.yaml")
    assert code_of("check", "clearance/") == 2  # by its slash it is the folder
