"""The command `report`, and the page that `simulate --report` puts beside a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.cli.completing import FILE, FOLDER, completes
from exudyn_flexlink.cli.keeping import added, why_not
from exudyn_flexlink.cli.options import add_command, add_force
from exudyn_flexlink.cli.terminal import DONE, FAILED, complain, refuse

if TYPE_CHECKING:
    from exudyn_flexlink.result import Result

ENDINGS = (".html", ".htm")


def add_report(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "report",
        report_command,
        "write the report of a saved run as one page of HTML, which loads nothing else",
        """\
        exudyn-flexlink report runs/no_clearance
        exudyn-flexlink report runs/no_clearance --out strike.html""",
    )
    run = parser.add_argument("run", type=Path, metavar="RUN", help="folder that 'simulate' wrote")
    completes(run, FOLDER)
    out = parser.add_argument(
        "--out",
        type=_page_file,
        metavar="FILE",
        help="where to, a file .html; default: report.html in the folder of the run",
    )
    completes(out, FILE)
    add_force(parser, "replace the file also if it is no report, or was changed since")


def report_command(options: argparse.Namespace) -> int:
    """Write the page of a saved run; returns the exit code."""
    from exudyn_flexlink.page import PAGE, write_page
    from exudyn_flexlink.storage import StorageError, load, staged_files

    file: Path = options.out or options.run / PAGE
    try:
        result = load(options.run)
        if options.out is None:
            with staged_files(options.run, force=options.force) as staged:
                write_page(result, staged / PAGE)
        else:
            write_page(result, file, force=options.force)
    except StorageError as error:
        return refuse(error)
    except Exception as error:  # a mistake of the program: the run itself is sound
        return complain(f"no report: {why_not(error)}; please report it", FAILED)
    print(f"Report written to {file}")
    return DONE


def reported(result: Result, folder: Path) -> int:
    """Write the page of a run beside its numbers; returns the exit code, see `added`."""
    from exudyn_flexlink.page import PAGE, write_page

    return added("report", lambda: write_page(result, folder / PAGE))


def _page_file(text: str) -> Path:
    """Read the name of a page's file, by whose ending a browser knows it."""
    file = Path(text)
    if file.suffix.lower() not in ENDINGS:
        raise argparse.ArgumentTypeError(f"'{text}' does not end in {' or '.join(ENDINGS)}")
    return file
