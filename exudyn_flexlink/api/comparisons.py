"""Two runs: side by side, as a notebook shows them, and one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import RESULT, page, style, style_of
from exudyn_flexlink.api.results import Result, own_result
from exudyn_flexlink.arguments import takes, two_texts
from exudyn_flexlink.comparison import Comparison as PlainComparison
from exudyn_flexlink.comparison import compare as compare_runs
from exudyn_flexlink.joining import joined as join
from exudyn_flexlink.observables import name_of
from exudyn_flexlink.report import comparison_text
from exudyn_flexlink.result import Result as PlainResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Comparison(PlainComparison):
    """Two runs at common instants: how far points are apart, strikes in pairs."""

    @takes(style=style)
    def plot(self, style: str = "screen") -> Figure:
        """Draw both runs over each other, and their difference.

        Raises:
            ValueError: the runs have no more than one instant in common; there is no such style.

        """
        from exudyn_flexlink import plots

        figure = plots.comparison(self, style=style_of(style))
        if figure is None:
            raise ValueError("the runs have no more than one instant in common")
        return figure

    def summary(self) -> str:
        """Return what the command line tells of the comparison."""
        return comparison_text(self)

    def __repr__(self) -> str:
        """Return one line: what was compared, and how far it is apart."""
        return (
            f"<Comparison of {self.first.name} and {self.second.name}: "
            f"{name_of(self.judged_by)} apart by {self.judged.largest:.3g} m at most>"
        )

    def _repr_html_(self) -> str:
        title = f"{self.first.name} and {self.second.name}"
        return page(title, self.summary(), self.plot() if len(self.time) > 1 else None)


@takes(first=RESULT, second=RESULT, names=two_texts)
def compare(
    first: PlainResult, second: PlainResult, *, names: tuple[str, str] | None = None
) -> Comparison:
    """Compare two runs of one scene, or with `names` of two scenes: rigid and flexible, say.

    Two scenes are compared in what both have, and instant by instant up to the earlier horizon.

    Raises:
        ValueError: the runs have nothing in common, or without names are not of one scene.

    """
    return with_methods(Comparison, compare_runs(first, second, names=names))


@takes(first=RESULT, second=RESULT)
def joined(first: PlainResult, second: PlainResult) -> Result:
    """Return one result of a run and of one that goes on from it, see `Result.continued`.

    It goes on from the end. Samples, forces, touches, extremes, laps and energies are those of
    both, as of one run. The error is that of the first run, and is known up to where the second
    begins: what the second makes of it nobody measured. The scene is the first one, which runs as
    long as both; settings and versions are those of the first.

    Raises:
        CannotContinueError: something presses where the first run ends.
        ValueError: the second run does not go on from there, or is by another engine; or a contact
            strikes a body that no joint carries, whose displacement is told from each start anew.

    """
    return own_result(join(first, second))
