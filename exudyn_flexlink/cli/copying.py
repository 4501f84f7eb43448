"""The command `new`: a model that comes with the program, copied to be changed."""

from __future__ import annotations

import argparse
import re
import shlex
import textwrap
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from exudyn_flexlink.cli.terminal import DONE, how_called, tell
from exudyn_flexlink.scene import is_schema
from exudyn_flexlink.shipped import model_names, models_folder
from exudyn_flexlink.source import load_document
from exudyn_flexlink.storage import StorageError, replace_file

SCHEMA = "flexlink.schema.json"
SCHEMA_LINE = re.compile(r"(?<=^# yaml-language-server: \$schema=)\S+", re.MULTILINE)
WIDTH = 80  # columns of the list of models


def new_command(options: argparse.Namespace) -> int:
    """Copy a model with the files it needs, or list all models; returns the exit code."""
    if options.list:
        tell(_listed())
        return DONE
    model: Path = options.model
    document = load_document(model)
    target: Path = options.file or Path(model.name)
    target = target / model.name if target.is_dir() else target
    points = list(dict.fromkeys(_point_files(document.data)))
    texts = {target: SCHEMA_LINE.sub(SCHEMA, document.text)}
    texts |= {target.with_name(name): _text(model.parent / name) for name in points}
    texts[target.with_name(SCHEMA)] = _text(models_folder() / SCHEMA)
    _write(texts, model.stem, force=options.force)
    tell(_told(target, document.data["title"], points))
    return DONE


def _point_files(value: Any) -> Iterator[str]:
    """Names of the CSV files that a model reads."""
    if isinstance(value, dict):
        if isinstance(value.get("file"), str):
            yield value["file"]
        value = list(value.values())
    for item in value if isinstance(value, list) else ():
        yield from _point_files(item)


def _write(texts: dict[Path, str], model: str, *, force: bool) -> None:
    """Write all of the files, the model first, or none that was not there."""
    new = [file for file in texts if not file.exists()]
    try:
        for file, text in texts.items():
            content = text.encode()
            same = holds_schema if file.name == SCHEMA else content.__eq__
            replace_file(file, content, same, force=force)
    except StorageError as error:
        for other in new:
            with suppress(OSError):
                other.unlink()
        if file != next(iter(texts)):
            hint = f"hint: '{model}' needs it beside itself; give a FILE in another folder"
            raise StorageError(f"{error}\n{hint}") from error
        raise


def _told(target: Path, title: str, points: list[str]) -> str:
    """Say what was written, and what may be done with it."""
    program, file = how_called(), shlex.quote(str(target))
    needed = [f"  {target.with_name(name)}  its points" for name in points]
    return "\n".join(
        [
            f"Written to {target}: {title}",
            *needed,
            f"  {target.with_name(SCHEMA)}  with which editors complete and check it",
            "",
            "Change it, look at what it is now, and run it:",
            f"  {program} check {file}",
            f"  {program} simulate {file}",
        ]
    )


def _listed() -> str:
    """All models with their titles: those of the paper first, then the other folders."""
    names = sorted(model_names(), key=lambda name: ("/" in name, name))
    titles = {name: load_document(models_folder() / f"{name}.yaml").data["title"] for name in names}
    lines, folder = [f"Models; '{how_called()} new MODEL' copies one:", ""], ""
    for name, title in titles.items():
        above = name.rpartition("/")[0]
        if above != folder:
            lines.append("")
        folder = above
        same = [len(other) for other in names if other.rpartition("/")[0] == above]
        row = f"  {name:{max(same)}}  "
        lines += textwrap.wrap(title, WIDTH, initial_indent=row, subsequent_indent=" " * len(row))
    return "\n".join(lines)


def holds_schema(content: bytes) -> bool:
    """Tell whether the content of a file is the schema of model files."""
    return is_schema(content.decode(errors="replace"))


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")
