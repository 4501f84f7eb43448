"""Completion by shells: the scripts are run by the shells that are there."""

import shutil
import subprocess
from pathlib import Path

import pytest
from cli_runs import code_of

from exudyn_flexlink.cli import main
from exudyn_flexlink.cli.completing import SHELLS
from exudyn_flexlink.shipped import model_names

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
