"""Verdicts on drawn scenes: what became of their runs, and tables of how many."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzzing.limits import TooLongError, limited

from exudyn_flexlink import NotRepresentableError, SceneError

RIGHT, TOLD, SILENT = "right", "over and told", "over SILENTLY"
REFUSED, LATE, CRASHED = "refused", "not waited for", "CRASHED"
STOPPED, OPEN = "stopped and said why", "nothing to judge by"
# Words of warnings that say that numbers may be off.
OF_ACCURACY = ("error", "tolerance", "energy", "may be off")


@dataclass(frozen=True)
class Verdict:
    """What became of a scene: by how many tolerances it is off, and what it says itself."""

    family: str
    kind: str
    off: float = 0.0
    told: str = ""


def of_file(
    text: str, family: str, seconds: float, judge: Callable[[Path], Verdict], rows: str = ""
) -> Verdict:
    """Judge a model file, with these rows beside it, in so much processor time (s)."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "drawn.yaml"
        path.write_text(text, encoding="utf-8")
        path.with_name("rows.csv").write_text(rows, encoding="utf-8")
        try:
            with limited(seconds), warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)  # NumPy's may reach no user
                return judge(path)
        except TooLongError:
            return Verdict(family, LATE)
        except (NotRepresentableError, SceneError) as error:
            return Verdict(family, REFUSED, told=str(error).splitlines()[0])
        except Exception as error:  # what a user would see as a traceback is looked for here
            return Verdict(family, CRASHED, told=f"{type(error).__name__}: {error}")


def table(
    found: Sequence[Verdict],
    families: Sequence[str],
    kinds: Sequence[str],
    of: Sequence[str],
    largest_of: str,
) -> Iterator[str]:
    """Lines that count the verdicts of each family, and give the largest error of some kinds."""
    yield f"| | {' | '.join(kinds)} | {largest_of}, tolerances |"
    yield "|---" * (len(kinds) + 2) + "|"
    for family in families:
        own = [verdict for verdict in found if verdict.family == family]
        counts = Counter(verdict.kind for verdict in own)
        largest = max((verdict.off for verdict in own if verdict.kind in of), default=0.0)
        numbers = " | ".join(str(counts[kind]) for kind in kinds)
        yield f"| {family} | {numbers} | {largest:.2g} |"
