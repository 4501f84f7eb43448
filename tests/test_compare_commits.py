"""What `scripts/compare_commits.py` makes of commits that are there or not."""

import sys

import compare_commits
import pytest
from compare_commits import ROOT, checked_out, row

in_repository = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not a git checkout")


@in_repository
def test_another_commit_is_checked_out_timed_and_removed_again():
    with checked_out("HEAD") as there:
        assert (there / "exudyn_flexlink" / "__init__.py").exists()
        cells = row(there, 1, "textbook/welded_cantilever", "exudyn", "run.duration=1 ms")
        assert cells[:2] == ("welded_cantilever", "exudyn")
        assert float(cells[4]) > 0
        with pytest.raises(RuntimeError, match="no_such_model"):
            row(there, 1, "no_such_model", "exudyn")
    assert not there.exists()


@pytest.mark.parametrize("words", [["no-such-commit"], ["HEAD", "no_such_scene"]])
def test_what_is_not_there_is_told_with_exit_code_2(words, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["compare_commits.py", *words])
    with pytest.raises(SystemExit) as ended:
        compare_commits.main()
    assert ended.value.code == 2
    assert words[-1] in capsys.readouterr().err
