"""How stable a motion is: whether it repeats itself, whether neighbours part, and how fast.

- `largest_exponent` measures the rate at which neighbours part, of any flow; `exponent_of` of a
  mechanism, by runs that go on from states of another run.
- `lap_distances` and `repeating` hold laps against earlier ones.
- `section_by_crank`, `section_by_time` and `Branches` are Poincare sections and how they branch.
- `study` does it all for a scene. No engine is known here: who calls says what runs a scene.

What can't be told is a ValueError: too few laps or free instants (TooShortError), laps that no run
can have (ImpossibleLapsError) or that nothing tells (NoRhythmError), a run that stopped.
"""

from exudyn_flexlink.stability.exponent import (
    Branches,
    Exponent,
    Flow,
    ImpossibleLapsError,
    LapDistances,
    Neighbours,
    NoRhythmError,
    Rhythm,
    Section,
    TooShortError,
    lap_distances,
    laps_of_cycle,
    largest_exponent,
    repeating,
    rhythm_of,
    section_by_crank,
    section_by_time,
    section_columns,
    section_of_row,
    section_row,
    trajectory,
)
from exudyn_flexlink.stability.study import (
    Asked,
    Stability,
    StoppedError,
    long_scene,
    require_possible,
    study,
)
