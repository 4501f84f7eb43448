"""Names of result folders: the model, and what the command line changes in it."""

from __future__ import annotations

import argparse
import hashlib
import re
from pathlib import Path

LONGEST = 80  # characters: a name that a listing shows whole, far below the 255 of file systems
DIGEST = 8  # hex digits of a SHA-256: 4e9 names; a folder holds a few hundred
UNSAFE = re.compile(r"[^\w.,=+-]+")  # what a shell, or a file system, takes for something else
NUMBER = re.compile(r"([+-]?[\d.]+(?:e[+-]?\d+)?)\s*([a-z][a-z /]*)?", re.IGNORECASE)


def run_name(options: argparse.Namespace, suffix: str = "") -> str:
    """Return the name of the folder for a run of a model with the options of the command line.

    Such as ``no_clearance-lagrangian-turns=2``. Only what changes the motion is in the name: the
    engine if it is not Exudyn, the kind of impact, effects left out, and settings, with what is
    varied, in the order of their names. A name that is too long, or has lost characters, ends in a
    digest of all of it.
    """
    model: Path = options.model
    # The stem of '..yaml' is '.', which would be the folder above.
    stem = model.stem if model.stem.strip(".") else model.name
    whole = f"{stem}{suffix}"
    engine = getattr(options, "engine", None) or "exudyn"
    parts = [engine] if engine != "exudyn" else []
    parts += [options.impact] if options.impact else []
    without = sorted(set(options.without))
    parts += [f"without_{'_'.join(without)}"] if without else []
    given = [*options.settings, *getattr(options, "vary", [])]
    settings = dict(setting.partition("=")[::2] for setting in given)
    told = [(_setting(path, value), f"{path}={value}") for path, value in sorted(settings.items())]
    parts += [name for name, _ in told]
    short = "-".join([whole, *parts])
    lossless = all(UNSAFE.search(name) is None for name in parts)
    if lossless and len(short) <= max(LONGEST, len(whole)):
        return short
    digest = hashlib.sha256("\n".join([*parts, *(text for _, text in told)]).encode()).hexdigest()
    room = max(LONGEST - len(whole) - DIGEST - 2, 0)  # 2: hyphens
    kept = UNSAFE.sub("_", "-".join(parts)).replace("=_", "=")[:room]
    return "-".join(part for part in (whole, kept.rstrip("-_.=,"), digest[:DIGEST]) if part)


def _setting(path: str, value: str) -> str:
    """Return a setting without its section, and a number without the spaces before its unit."""
    key = path.strip().partition(".")[2] or path.strip()
    value = value.strip()
    quantity = NUMBER.fullmatch(value)
    if quantity:  # "15 rad/s", "2 N m s/rad": no unit has a dot or an underscore, nothing is lost
        number, unit = quantity[1], quantity[2] or ""
        value = number + ".".join(unit.split()).replace("/", "_")
    return f"{key}={value}"
