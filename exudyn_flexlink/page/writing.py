"""A page to its file, whole or not at all."""

from __future__ import annotations

from pathlib import Path

from exudyn_flexlink.page.rendering import is_page, page_of
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import replace_file

PAGE = "report.html"
"""Name of the page in the folder of its run."""


def write_page(result: Result, file: Path, *, force: bool = False) -> None:
    """Write the page of a run; one that stands there is replaced, another file only with `force`.

    Raises:
        StorageError: the file may not be replaced, or can't be written.

    """
    replace_file(file, page_of(result).encode("utf-8"), is_page, force=force)
