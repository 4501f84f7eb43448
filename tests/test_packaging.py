"""What is built and installed: the source distribution, and the wheel in a bare environment."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from cli_runs import ROOT

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.shipped import benchmark_files, model_names

NOT_BUILT = {".gitignore"}
RUN = [sys.executable, *(["-P"] if sys.version_info >= (3, 11) else [])]


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return a copy of what is in the repository, or would be."""
    pytest.importorskip("setuptools", minversion="77")
    copy = tmp_path_factory.mktemp("source")
    command = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others"]
    listed = subprocess.run([*command, "--exclude-standard"], capture_output=True, check=True)
    for name in listed.stdout.decode().split("\0"):
        if name and (ROOT / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (copy / name).write_bytes((ROOT / name).read_bytes())
    return copy


@pytest.fixture(scope="module")
def installed(source, tmp_path_factory):
    """Return a folder with the content of the wheel."""
    folder = tmp_path_factory.mktemp("installed")
    code = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", code, str(folder)], cwd=source, capture_output=True, check=True
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def run(folder, here, *arguments):
    """Run the program of a folder, somewhere else, where nothing else is known than HOME."""
    bare = {"PATH": os.defpath, "HOME": str(here), "PYTHONPATH": str(folder)}
    ran = subprocess.run(
        [*RUN, *arguments], env=bare, cwd=here, capture_output=True, text=True, check=True
    )
    return ran.stdout


def test_the_source_distribution_is_complete(source, tmp_path):
    files = {path.relative_to(source).as_posix() for path in source.rglob("*") if path.is_file()}
    code = "import sys; from setuptools import build_meta; build_meta.build_sdist(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], cwd=source, capture_output=True, check=True
    )
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        built = {name.partition("/")[2] for name in opened.getnames()}
    generated = {name for name in files if ".egg-info" in name or name.startswith("build/")}
    assert files - built - generated == NOT_BUILT


def test_the_wheel_brings_all_and_a_model_of_it_is_copied_and_run_anywhere(installed, tmp_path):
    """Models, published numbers, the player; the commands that `new` prints run as printed."""
    code = (
        "import exudyn_flexlink as fl; from exudyn_flexlink import shipped;"
        "print(fl.load_scene('spline_track').title); print(*shipped.model_names());"
        "print(*shipped.benchmark_files().values())"
    )
    title, names, numbers = run(installed, tmp_path, "-c", code).splitlines()
    assert title == load_scene(ROOT / "models" / "spline_track.yaml").title
    assert names.split() == model_names()
    files = [Path(file) for file in numbers.split()]
    assert [file.name for file in files] == [file.name for file in benchmark_files().values()]
    assert all(file.is_relative_to(installed) for file in files)
    player = Path("exudyn_flexlink") / "animation" / "player"
    there, brought = ({path.name for path in (top / player).iterdir()} for top in (ROOT, installed))
    assert there == brought
    told = run(installed, tmp_path, "-m", "exudyn_flexlink", "new", "textbook/pendulum_on_stop")
    printed = [line.split() for line in told.splitlines() if " -m exudyn_flexlink " in line]
    assert [words[-2:] for words in printed] == [["check", "pendulum_on_stop.yaml"],
                                                 ["simulate", "pendulum_on_stop.yaml"]]  # fmt: skip
    check, simulate = (words[words.index("-m") :] for words in printed)
    assert run(installed, tmp_path, *check)
    simulate += ["--set=run.duration=0.1", "--out=made"]
    assert run(installed, tmp_path, *simulate, "--report")  # its templates are in the wheel
    made = tmp_path / "made"
    assert (made / "mechanism.png").is_file()
    assert "A pendulum on a stop" in (made / "report.html").read_text(encoding="utf-8")
