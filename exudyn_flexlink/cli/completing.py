"""The command `completion`: a script with which a shell completes this program's arguments."""

from __future__ import annotations

import argparse

from exudyn_flexlink.cli.terminal import DONE, PROGRAM

SHELLS = ("bash", "zsh")
PREFIX = "_exudyn_flexlink_"  # of the scripts' functions

# What follows a command. shtab's bash script takes functions with "_file" or "_dir" in their names
# for those of paths, and puts a slash, not a space, behind a folder.
MODEL, MODEL_OR_FILE, FILE, FOLDER = "model", "file_or_model", "file", "dir"
BENCHMARK = "benchmark"

BASH = """\
{prefix}model() {{ compgen -W "{names}" -- "$1"; }}
{prefix}benchmark() {{ compgen -W "{benchmarks}" -- "$1"; }}
{prefix}file() {{ compgen -f -- "$1"; }}
{prefix}dir() {{ compgen -d -- "$1"; }}
{prefix}file_or_model() {{ {prefix}model "$1"; {prefix}file "$1"; }}
"""
ZSH = """\
{prefix}model() {{ _values -w model {names} }}
{prefix}benchmark() {{ _values -w benchmark {benchmarks} }}
{prefix}file() {{ _files }}
{prefix}dir() {{ _files -/ }}
{prefix}file_or_model() {{ _alternative "models:model:({names})" "files:file:_files" }}
"""


def completion_command(options: argparse.Namespace) -> int:
    """Print the script for a shell; returns the exit code."""
    import shtab

    from exudyn_flexlink.cli.arguments import program_parser
    from exudyn_flexlink.shipped import benchmark_files, model_names

    functions = {"bash": BASH, "zsh": ZSH}[options.shell]
    named = {"names": " ".join(model_names()), "benchmarks": " ".join(benchmark_files())}
    preamble = functions.format(prefix=PREFIX, **named)
    print(shtab.complete(program_parser(PROGRAM), options.shell, preamble=preamble))
    return DONE
