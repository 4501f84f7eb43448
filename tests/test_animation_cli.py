"""The command `animate`, and `result.animate` from Python."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import results

import exudyn_flexlink as fl
from exudyn_flexlink.animation import writing as writing_room
from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.cli import main

FEW = ["--from", "0.3", "--to", "0.31", "--speed", "0.05", "--width", "200"]


@pytest.fixture(scope="module")
def run():
    return api_result(results.rigid_link(turns=2.0, samples=201))


@pytest.fixture
def saved(run):
    results.put(run, "run")


def said(capsys, *arguments):
    code = main(["animate", *arguments])
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    return code, told.out, told.err


def test_a_run_is_animated_in_its_folder(saved, capsys):
    asked = ["--format", "gif,gif", "--format", "html,gif"]  # formats add up
    code, out, err = said(capsys, "run", *asked, *FEW)
    assert (code, out, err) == (0, "Written to run/: animation.gif, animation.html\n", "")
    assert Path("run/animation.gif").read_bytes().startswith(b"GIF89a")
    assert Path("run/animation.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    # Its own files are replaced, the run stays as it was.
    assert said(capsys, "run", "--format", "html")[0] == 0
    assert fl.load("run").outcome.completed


def test_without_ffmpeg_a_gif_and_a_page_are_written(saved, capsys, monkeypatch):
    monkeypatch.setattr(writing_room, "ffmpeg", lambda: None)
    code, out, _ = said(capsys, "run", "--out", "films", *FEW)
    assert (code, out) == (0, "Written to films/: animation.gif, animation.html\n")
    code, _, err = said(capsys, "run", "--format", "mp4")
    assert code == 2
    assert "a video needs the program ffmpeg" in err


def test_two_runs_over_each_other(saved, run, capsys):
    results.put(replace(run, engine="lagrangian"), "other")
    code, out, _ = said(capsys, "run", "--with", "other", "--format", "html")
    assert (code, out) == (0, "Written to run/: animation_with_other.html\n")
    text = Path("run/animation_with_other.html").read_text(encoding="utf-8")
    assert '"name":"exudyn"' in text
    assert '"name":"lagrangian"' in text
    results.put(run, "third")
    assert said(capsys, "run", "--with", "third", "--format", "html")[0] == 0
    text = Path("run/animation_with_third.html").read_text(encoding="utf-8")
    assert '"name":"run"' in text
    assert '"name":"third"' in text


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nowhere"], ["nowhere is no folder"]),
        (["nowhere", "--with", "nor_there"], ["nowhere is no folder", "nor_there is no folder"]),
        (["run", "--from", "2", "--slow", "strike:9"],
         ["the begin 2 s is not within the run", "no strike number 9 of 'strike': it struck once"]),
        (["run", "--fps", "100", "--width", "3", "--format", "gif", "--to", "-4"],
         ["100 frames in a second", "3 pixels: a width is from", "the end -4 s is not within"]),
        (["run", "--fps", "9", "--width", "300", "--format", "html"],
         ["'--fps' and '--width' are for mp4 and gif"]),
        (["run", "--speed", "1e-9", "--format", "gif"], ["too long"]),
    ],
)  # fmt: skip
def test_all_mistakes_are_told_at_once_and_nothing_is_written(saved, capsys, arguments, told):
    before = sorted(Path("run").iterdir())
    code, out, err = said(capsys, *arguments)
    assert (code, out) == (2, "")
    for words in told:
        assert words in err
    assert sorted(Path("run").iterdir()) == before


def test_a_file_of_the_user_is_not_replaced(saved, capsys):
    Path("films").mkdir()
    Path("films/animation.html").write_text("mine", encoding="utf-8")
    code, _, err = said(capsys, "run", "--out", "films", "--format", "html")
    assert code == 2
    assert "animation.html" in err
    assert Path("films/animation.html").read_text(encoding="utf-8") == "mine"
    assert said(capsys, "run", "--out", "films", "--format", "html", "--force")[0] == 0


def test_python_writes_files_and_shows_a_player(run):
    shown = run.animate("s.html", begin=0.1, end=0.6, slow="strike")
    assert repr(shown).endswith("by exudyn: 0.1 s to 0.6 s>")
    assert Path("s.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    run.animate("s.html")  # its own files are replaced
    frame = shown._repr_html_()
    assert frame.startswith('<iframe srcdoc="&lt;!DOCTYPE html&gt;')
    assert frame.count('"') == 4
    assert shown.html().startswith('<div class="flexlink-player">')
    seen = []
    run.animate("s.gif", begin=0.3, end=0.31, speed=0.05, width=200, progress=seen.append)
    assert Path("s.gif").read_bytes().startswith(b"GIF89a")
    assert seen[-1] == 1.0


ODD = {
    "a pendulum": results.pendulum,
    "a block in a slot": results.slider,
    "a link with clearance": lambda: results.tilting_link(samples=401),
    "what stands still": lambda: results.block(np.zeros_like, np.zeros_like),
    "what stopped": lambda: results.stopped(results.pendulum()),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("made", ODD.values(), ids=ODD)
def test_any_run_is_animated(made, capsys):
    run = made()
    results.put(run, "odd")
    end = float(run.time[-1])
    few = ["--speed", f"{end}", "--fps", "5", "--width", "200", "--format", "gif,html"]
    assert said(capsys, "odd", *few)[0] == 0
