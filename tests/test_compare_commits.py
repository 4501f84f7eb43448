"""What `scripts/compare_commits.py` makes of runs, and of commits that are there or not."""

import subprocess
import sys

import compare_commits
import numpy as np
import pytest
from compare_commits import ROOT, Case, Motion, apart

from exudyn_flexlink import load_scene

in_repository = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not a git checkout")


def moved(by, seconds=1.0, step=0.1):
    time = np.arange(0, 1.05, step)
    places = np.zeros((len(time), 2, 2))
    places[-1, 1] = by
    return Motion(time, places, seconds)


def test_motions_are_compared_at_the_instants_that_both_have():
    assert apart(moved((3e-3, 4e-3)), moved((0, 0), step=0.05)) == "5.0e-03"
    fewer = Motion(np.zeros(1), np.zeros((1, 1, 2)), 1.0)
    assert apart(moved((0, 0)), fewer) == "not the same bodies or instants"


@pytest.mark.parametrize("case", compare_commits.CASES, ids=lambda case: case.scene)
def test_models_are_there_and_other_words_replace_some(case, tmp_path):
    file = case.file(tmp_path)
    text = (ROOT / "models" / f"{case.model}.yaml").read_text(encoding="utf-8")
    assert all(words in text for words, _ in case.instead)
    assert (file.parent == tmp_path) is bool(case.instead)
    load_scene(file)


@in_repository
def test_another_commit_is_checked_out_and_removed_again():
    with compare_commits.checked_out(compare_commits.commit_of("HEAD")) as there:
        assert (there / "exudyn_flexlink" / "__init__.py").exists()
        short = Case("textbook/welded_cantilever", "exudyn", 1.0)
        assert compare_commits.simulated(there, short, 1e-6, runs=1).seconds > 0
    assert not there.exists()
    listed = ["git", "-C", str(ROOT), "worktree", "list"]
    assert str(there) not in subprocess.check_output(listed, text=True)


@pytest.mark.parametrize("words", [["no-such-commit"], ["HEAD", "no_such_scene"]])
def test_what_is_not_there_is_told_with_exit_code_2(words, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["compare_commits.py", *words])
    with pytest.raises(SystemExit) as ended:
        compare_commits.main()
    assert ended.value.code == 2
    assert words[-1] in capsys.readouterr().err
