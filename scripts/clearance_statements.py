"""Put to the test what the paper says of clearance: more excitation, a higher first amplitude.

  .venv/bin/python scripts/clearance_statements.py
  .venv/bin/python scripts/clearance_statements.py --engine lagrangian

For clearances from none to 5 mm and three restitutions of the walls it prints, over the first two
laps, of the perturbation of S (against the rigid link without clearance): its rms, that of its fast
part (above 15 Hz: vibration, not the tilt in the guide), the time in which the fast
part decays to a tenth after the strike, and the lever's first amplitude.

Errors multiply from touch to touch, so that two laps are not known at the models' own tolerances.
Each number is that of two runs, at `TOLERANCE` and ten times that, to the digits in which both
agree. Takes ten minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfiltfilt

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import lever_response, positions, strikes
from exudyn_flexlink.plots.panels import number_text
from exudyn_flexlink.result import Result

TOLERANCE = 1e-10  # m
FACTOR = 3.0  # of the distance of two runs: what is told of the error of the better one
DIGITS = 5  # at most
STEP = 5e-4  # s, between samples
HIGH = 15.0  # Hz: the slowest vibration of the link has 29
UNITS = (("mm", 0.0), ("mm", 0.0), ("s", STEP), ("rad", 0.0))  # and how finely a number is found
COMMON = ["run.turns=2", f"run.sample={STEP}"]
COLUMNS = (
    "clearance",
    "rms of S - S_rigid",
    "its fast part",
    "decays to 1/10 in",
    "lever, first amplitude",
)
VARIANTS = {
    "none": ("no_clearance", []),
    "supported": ("supported", []),
    "0.5 mm": ("clearance", ["joints.sleeve.clearance=0.5 mm"]),
    "2 mm": ("clearance", ["joints.sleeve.clearance=2 mm"]),
    "5 mm, walls' e 0.5": ("clearance", []),
    "5 mm, walls' e 0.2": ("clearance", ["joints.sleeve.law.restitution=0.2"]),
    "5 mm, walls' e 0.8": ("clearance", ["joints.sleeve.law.restitution=0.8"]),
    "5 mm, friction 0.15": ("clearance_friction", []),
    "5 mm, 'beam' hinges": ("clearance", ["bodies.link.hinges.stiffness=beam"]),
    "none, 'beam' hinges": ("no_clearance", ["bodies.link.hinges.stiffness=beam"]),
}


def main() -> None:
    """Run all variants, and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default="exudyn")
    engine = parser.parse_args().engine
    time = np.arange(0, 1.2566, STEP)
    print(f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|", sep="\n")
    for name, (model, settings) in VARIANTS.items():
        both = []
        for tolerance in (TOLERANCE, 10 * TOLERANCE):
            given = [*COMMON, *settings, f"accuracy.tolerance={tolerance}"]
            run, rigid = (
                simulate(load_scene(own, values), engine, measure=False)
                for own, values in ((model, given), ("rigid", [*COMMON, given[-1]]))
            )
            both.append(numbers(run, rigid, time))
        print(row(name, *both), flush=True)


def numbers(result: Result, rigid: Result, time: FloatArray) -> list[float]:
    """Rms of the perturbation of S and of its fast part, mm; its decay, s; the lever's angle."""
    place, ideal = (positions(run, ["link.end"], time)[:, 0] for run in (result, rigid))
    off = place - ideal
    fast = np.linalg.norm(fast_part(off), axis=1)
    decay = decay_time(time, fast, strikes(result, "strike")[0].begin)
    rms = (1e3 * np.sqrt(np.mean(np.sum(part**2, axis=-1))) for part in (off, fast[:, None]))
    return [*map(float, rms), decay, lever_response(result, "strike").least[0]]


def row(name: str, better: Sequence[float], other: Sequence[float]) -> str:
    """One line of the table, of the numbers of two runs."""
    cells = []
    for one, two, (unit, grid) in zip(better, other, UNITS, strict=True):
        text = number_text(
            one, max(FACTOR * abs(one - two), grid), signed=unit == "rad", most=DIGITS
        )
        known = np.isfinite([one, two]).all()
        cells.append(
            f"{text} {unit}".replace("\N{MINUS SIGN}", "-") if known else "not in two laps"
        )
    return f"| {name} | {' | '.join(cells)} |"


def fast_part(off: FloatArray) -> FloatArray:
    """What is above `HIGH` Hz of an offset (N, 2): vibration of the link."""
    return np.asarray(sosfiltfilt(butter(4, HIGH, "highpass", fs=1 / STEP, output="sos"), off, 0))


def decay_time(time: FloatArray, fast: FloatArray, begin: float) -> float:
    """Time (s) after a strike until the fast part stays below a tenth of its greatest."""
    after = time > begin
    large = np.flatnonzero(fast[after] > 0.1 * fast[after].max())
    last = time[after][large[-1]]
    return float(last - begin) if last < time[-1] - 0.05 else float("inf")


if __name__ == "__main__":
    main()
