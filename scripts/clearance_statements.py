"""Put to the test what the paper says of clearance: more excitation, a higher first amplitude.

  .venv/bin/python scripts/clearance_statements.py
  .venv/bin/python scripts/clearance_statements.py --engine lagrangian

For clearances from none to 5 mm and three restitutions of the walls it prints, over the first two
laps, of the perturbation of S (against the rigid link without clearance): its rms, that of its fast
part (above 15 Hz: vibration, not the tilt in the guide), the time in which the fast
part decays to a tenth after the strike, and the lever's first amplitude. Takes about five minutes.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.signal import butter, sosfiltfilt

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import lever_response, positions, strikes
from exudyn_flexlink.result import Result

STEP = 5e-4  # s, between samples
HIGH = 15.0  # Hz: the slowest vibration of the link has 29
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
    rigid = simulate(load_scene("rigid", COMMON), engine, measure=False)
    print(f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|", sep="\n")
    for name, (model, settings) in VARIANTS.items():
        result = simulate(load_scene(model, [*COMMON, *settings]), engine, measure=False)
        print(row(name, result, rigid, time), flush=True)


def row(name: str, result: Result, rigid: Result, time: FloatArray) -> str:
    """One line of the table."""
    place, ideal = (positions(run, ["link.end"], time)[:, 0] for run in (result, rigid))
    off = place - ideal
    fast = np.linalg.norm(fast_part(off), axis=1)
    least = lever_response(result, "strike").least[0]
    decay = decay_time(time, fast, strikes(result, "strike")[0].begin)
    shown = f"{decay:.3f} s" if np.isfinite(decay) else "not in two laps"
    return (
        f"| {name} | {1e3 * np.sqrt(np.mean(np.sum(off**2, axis=1))):.3f} mm "
        f"| {1e3 * np.sqrt(np.mean(fast**2)):.3f} mm | {shown} | {least:+.5f} rad |"
    )


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
