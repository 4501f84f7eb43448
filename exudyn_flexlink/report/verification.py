"""Benchmarks held against published numbers: as text, as Markdown, as data for JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from exudyn_flexlink.report.text import table
from exudyn_flexlink.verification import Compared, VerifiedRun

HEAD = ("number", "published", "computed", "difference", "allowed", "verdict")


def verification_text(runs: Sequence[VerifiedRun]) -> str:
    """Return a table of each run, and a sentence on all of them."""
    blocks = []
    for one in runs:
        about = f"{one.benchmark}, {one.run}: {one.steps} steps, {one.seconds:.2g} s"
        lines = [about] if one.engine == "exudyn" else [f"{about}, {one.engine}"]
        lines += [f"  {one.stopped}"] if one.stopped else []
        lines += table([HEAD, *(_row(number) for number in one.numbers)])
        blocks.append("\n".join(lines))
    return "\n\n".join([*blocks, _summary(runs), *_reasons(runs)])


def verification_markdown(runs: Sequence[VerifiedRun]) -> str:
    """Return one table of all numbers, with the steps and the time of each run."""
    head = ("benchmark", "run", *HEAD[:-1], "steps", "time", HEAD[-1])
    rows = [head, ("---",) * len(head)]
    for one in runs:
        for number in one.numbers:
            *cells, verdict = _row(number)
            cost = (str(one.steps), f"{one.seconds:.1f} s")
            rows.append((f"`{one.benchmark}`", one.run, *cells, *cost, verdict))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def verification_data(runs: Sequence[VerifiedRun]) -> list[dict[str, Any]]:
    """Return plain data; null stands for a number that the run did not come to."""
    return [
        {
            **asdict(one),
            "fine": one.fine,
            "numbers": [
                {**asdict(own), "difference": own.difference, "fine": own.fine}
                for own in one.numbers
            ],
        }
        for one in runs
    ]


def _row(number: Compared) -> tuple[str, ...]:
    published = f"{number.published:.10g} {number.unit}"
    allowed, verdict = f"{number.allowed:.1e}", "ok" if number.fine else "OFF"
    if not isfinite(number.computed):
        return number.name, published, "none", "", allowed, verdict
    computed = f"{number.computed:.10g}"
    return number.name, published, computed, f"{number.difference:.1e}", allowed, verdict


def _summary(runs: Sequence[VerifiedRun]) -> str:
    numbers = [number for one in runs for number in one.numbers]
    off = sum(not number.fine for number in numbers)
    end = "all are as near as allowed" if not off else f"{off} {'is' if off == 1 else 'are'} off"
    many = f"{len(numbers)} numbers" if len(numbers) != 1 else "1 number"
    return f"{many}: {end}"


def _reasons(runs: Sequence[VerifiedRun]) -> Iterator[str]:
    """Who published the numbers that are off, and what was allowed to them."""
    for one in runs:
        for number in one.numbers:
            if not number.fine:
                name = f"{one.benchmark}, {one.run}, {number.name}"
                yield f"{name}\n  allowed because: {number.because}\n  source: {number.source}"
