"""Commands of README and documentation, run as printed: page by page, in their order.

They run in a folder that has the repository's models and docs, with nothing but PATH and HOME set,
and whoever asks for the network is ended. Those of README are processes, where HOME is no folder;
those of another page share one process, which draws one figure of a run for eight, and 2 frames of
a second for 30. A command that was run there is not run again. Of the models in the folder,
flexible links have 2 rods for 10, a run 0.6 turns for 4, a crank is four times as fast, and points
may be off by 0.1 mm: commands do the same in less time.
`test_docs` and the tests of the engines run the models as they are, `test_plots` draws all figures.
"""

import json
import os
import shutil
import subprocess
import sys

import pytest
from cli_runs import BARE
from pages_of_docs import PROGRAM, ROOT, commands

PAGES = (("README.md", "running.md"), ("tutorial.md",), ("engines.md",))  # which share a folder
NO_NETWORK = """
import os, socket


class Offline(socket.socket):
    def connect(self, address):
        if self.family in (socket.AF_INET, socket.AF_INET6):
            os._exit(99)
        return super().connect(address)


socket.socket = Offline
socket.getaddrinfo = lambda *_, **__: os._exit(99)
"""
"""What Python imports by itself as it starts, as `sitecustomize`."""
IN_ONE_PROCESS = """
import json, math, sys
from exudyn_flexlink import plots
from exudyn_flexlink.animation import writing
from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import interrupts

writing.GIF_FPS = writing.VIDEO_FPS = 2.0
interrupts.SURE = math.inf  # s: no second run in a process of its own, which imports all anew
for name in set(plots.FIGURES) - {"coordinates"}:
    del plots.FIGURES[name]
for words in json.loads(sys.argv[1]):
    if main(words) != 0:
        sys.exit(f"failed: {words}")
"""


def printed(page):
    """Arguments of the program, of all its commands that a page prints."""
    return [words[1:] for name, words in commands() if (name, words[0]) == (page, PROGRAM)]


SMALLER = {
    "rods: 10": "rods: 2",
    "turns: 4": "turns: 0.6",
    "value: 10 rad/s": "value: 40 rad/s",
    "tolerance: 1.0e-6": "tolerance: 1.0e-4",
}


@pytest.fixture
def place(tmp_path):
    """Return a folder with `here`, in which a reader types, and what keeps the network off."""
    for name in ("here", "site"):
        (tmp_path / name).mkdir()
    for name in ("models", "docs"):
        shutil.copytree(ROOT / name, tmp_path / "here" / name)
    for file in (tmp_path / "here").rglob("*.yaml"):
        text = file.read_text(encoding="utf-8")
        for large, small in SMALLER.items():
            text = text.replace(large, small)
        file.write_text(text, encoding="utf-8")
    (tmp_path / "site/sitecustomize.py").write_text(NO_NETWORK)
    return tmp_path


def ran(place, home, *words):
    """Run the interpreter as a reader does."""
    paths = os.pathsep.join([str(place / "site"), str(ROOT)])
    return subprocess.run(
        [sys.executable, *words], cwd=place / "here", stdin=subprocess.DEVNULL,
        env={**BARE, "HOME": str(place / home), "PYTHONPATH": paths},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_who_asks_for_the_network_is_ended(place):
    """Without this the next test would show nothing of it."""
    asks = "import urllib.request; urllib.request.urlopen('http://127.0.0.1:9')"
    assert ran(place, "home", "-c", asks).returncode == 99


@pytest.mark.parametrize("pages", PAGES, ids=" ".join)
def test_the_commands_of_a_page_run_as_printed(pages, place):
    (place / "home").mkdir()
    (place / "no home").write_text("no folder: nothing can be written to it, not even by root")
    done = []
    for page in pages:
        asked = [words for words in printed(page) if words not in done]
        calls = [("home", "-c", IN_ONE_PROCESS, json.dumps(asked))]
        if page == "README.md":
            calls = [("no home", "-m", "exudyn_flexlink", *words) for words in asked]
        assert asked
        for call in calls:
            found = ran(place, *call)
            assert found.returncode == 0, found.stderr
            assert "Traceback" not in found.stderr
            assert "MPLCONFIGDIR" not in found.stderr  # nobody need know where fonts are kept
        done += asked
