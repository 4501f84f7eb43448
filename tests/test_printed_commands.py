"""Commands of README and documentation, run as printed: page by page, in their order.

They run in a folder that has the repository's models, docs and scripts, with nothing but PATH and
HOME set, and whoever asks for the network is ended. Those of README run where HOME is no folder.
What installs something, or takes more than minutes, is not run.
"""

import os
import subprocess
import sys

import pytest
from cli_runs import BARE
from pages_of_docs import ROOT, commands

PAGES = ("README.md", "tutorial.md", "running.md", "engines.md")
PYTHON = ".venv/bin/python"
NOT_RUN = {
    "pytest": "it runs the tests",
    "sphinx": "CI builds the site",
    "scripts/fuzz_loader.py": "it takes an hour; tests/test_fuzzing.py runs parts of it",
}
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


def printed(page):
    """Arguments of the interpreter, of all commands of a page that are run here."""
    found = [words[1:] for name, words in commands() if (name, words[0]) == (page, PYTHON)]
    return [words for words in found if not NOT_RUN.keys() & set(words)]


def site_without_network(parent):
    site = parent / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(NO_NETWORK)
    return site


@pytest.fixture
def folder(tmp_path):
    """Return the folder in which a reader types: the repository's, as far as commands see."""
    here = tmp_path / "here"
    here.mkdir()
    for name in ("models", "docs", "scripts"):
        (here / name).symlink_to(ROOT / name)
    return here


def test_who_asks_for_the_network_is_ended(tmp_path):
    """Without this the next test would show nothing of it."""
    asks = "import urllib.request; urllib.request.urlopen('http://127.0.0.1:9')"
    environment = {**BARE, "PYTHONPATH": str(site_without_network(tmp_path))}
    assert (
        subprocess.run([sys.executable, "-c", asks], env=environment, check=False).returncode == 99
    )


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_run_as_printed(page, folder):
    home = folder.parent / "home"
    if page == "README.md":
        home.write_text("no folder: nothing can be written to it, not even by root")
    else:
        home.mkdir()
    paths = f"{site_without_network(folder.parent)}{os.pathsep}{ROOT}"
    environment = {**BARE, "HOME": str(home), "PYTHONPATH": paths}
    assert printed(page)
    for words in printed(page):
        ran = subprocess.run(
            [sys.executable, *words], cwd=folder, env=environment,
            stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert ran.returncode == 0, (words, ran.stderr)
        assert "Traceback" not in ran.stderr, words
        if words[0] == "-m":  # scripts let matplotlib tell that it can't keep its fonts at home
            assert "MPLCONFIGDIR" not in ran.stderr, words
