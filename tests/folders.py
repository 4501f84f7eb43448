"""Folders of the user, and what stands in them, for tests of what a run writes and replaces."""

import os
import sys
from pathlib import Path

import pytest
from cli_runs import NO_CLEARANCE

from exudyn_flexlink.cli import main

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")


def tree(folder="."):
    """All files in a folder with their content; links are not followed."""
    paths = sorted(path for path in Path(folder).rglob("*") if path.is_symlink() or path.is_file())
    return {
        path.relative_to(folder).as_posix(): os.readlink(path)
        if path.is_symlink()
        else path.read_bytes()
        for path in paths
    }


def mine(*names):
    """Write files of the user."""
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text("mine", encoding="utf-8")


def simulate(*options):
    """Run the paper's mechanism into the folder 'o'; the exit code."""
    return main(["simulate", NO_CLEARANCE, "--no-plots", "--quiet", "--out=o", *options])
