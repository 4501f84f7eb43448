"""Figures to files, in the formats that are asked for."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

FORMATS = ("png", "pdf", "svg")
"""Formats that figures are written in; the first is the usual one."""

MISSING = "Glyph .* missing from font"
"""A warning of matplotlib: a letter that it has no font for is drawn as a box."""

# Text in a PDF as outlines that printers take (TrueType); the same file from the same run.
_RC: dict[Any, Any] = {"pdf.fonttype": 42, "svg.hashsalt": "exudyn-flexlink"}
_UNDATED: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}


def save_figure(
    figure: Figure, folder: Path, name: str, formats: Sequence[str] = FORMATS[:1]
) -> list[Path]:
    """Write a figure as ``<name>.<format>`` into an existing folder; returns the files.

    Raises:
        OSError: a file can't be written.

    """
    written = [Path(folder) / f"{name}.{suffix}" for suffix in formats]
    for file, suffix in zip(written, formats, strict=True):
        file.write_bytes(figure_bytes(figure, suffix))
    return written


def figure_bytes(figure: Figure, suffix: str, dpi: float | None = None) -> bytes:
    """Return a figure as the content of a file of a format, with its own dots per inch or `dpi`."""
    written = BytesIO()
    with mpl.rc_context(_RC), warnings.catch_warnings():
        warnings.filterwarnings("ignore", MISSING)
        figure.savefig(written, format=suffix, dpi=dpi or figure.dpi, metadata=_UNDATED.get(suffix))
    return written.getvalue()


def is_figure(content: bytes) -> bool:
    """Whether the content of a file is a figure of matplotlib's, which it says in every format."""
    return b"atplotlib" in content
