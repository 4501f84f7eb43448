"""The program at a terminal: arguments in, one function called, an exit code out.

Exit codes: 0 done; 1 the run or only its figures failed (what was computed is kept), a comparison
exceeds its tolerance, or a benchmark is off; 2 bad input, or a place that can't be written; 130
interrupted; 143 or 129 ended by SIGTERM or by SIGHUP.
A command refuses its input by an exception, one of `keeping.REFUSALS`; the exit code is then 2.
A help text must appear at once, so the modules with options import nothing else. The module of a
command is imported when the command runs, and the module of figures when figures are drawn.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence

from exudyn_flexlink.cli.arguments import program_parser
from exudyn_flexlink.cli.figures import idle_options
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    INTERRUPTED,
    Ending,
    complain,
    ended_by_signals,
    how_called,
    prepare_streams,
    release_streams,
)
from exudyn_flexlink.shipped import NoModelsError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program with the arguments of a command line; returns its exit code."""
    prepare_streams()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # no warning of a read-only home
    with ended_by_signals() as ending:
        try:
            return ending.code(_run(arguments, ending))
        finally:
            release_streams()


def _run(arguments: Sequence[str] | None, ending: Ending) -> int:
    try:
        try:
            options = program_parser(how_called()).parse_args(arguments)
            options.ending = ending
            idle = idle_options(options)
            code: int = complain(idle, BAD_INPUT) if idle else options.command(options)
        except NoModelsError as error:
            code = complain(str(error), BAD_INPUT)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        return complain("interrupted; nothing was written", INTERRUPTED)
    except MemoryError:
        return complain("not enough memory: shorten the run, or give a longer run.sample", FAILED)
    except OSError as error:  # of the output: commands handle errors of files themselves
        if ending.asked:  # the terminal was closed
            return INTERRUPTED
        if isinstance(error, BrokenPipeError):  # the reader, such as `head`, has seen enough
            return DONE
        return complain(f"can't write to the output: {error.strerror or error}", FAILED)
    return code
