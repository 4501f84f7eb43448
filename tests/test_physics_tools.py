"""What the tests named after laws of nature share: inline scenes, runs, closed forms."""

from pathlib import Path

import numpy as np

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.mechanism import accelerations, build_mechanism
from exudyn_flexlink.observables import path
from exudyn_flexlink.source import parse_document

MODELS = Path(__file__).parent.parent / "models"

STEEL = "materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}\n"
SQUARE = "section: {width: 10 mm, thickness: 10 mm}"
KILOGRAM = 7850 * 1e-4 * 1.0  # kg, mass of one metre of SQUARE


def scene(text, *settings):
    """Scene of inline YAML."""
    return scene_of(parse_document("title: law\n" + text, "law.yaml"), settings)


def run(text, *settings):
    """Result of inline YAML, which must run to its end without a warning."""
    result = simulate(scene(text, *settings))
    assert result.outcome.completed, result.outcome
    assert result.warnings == ()
    return result


def run_model(name, *settings):
    """Result of a model file with settings."""
    result = simulate(load_scene(MODELS / name, settings))
    assert result.outcome.completed, result.outcome
    return result


def rod(length=1.0):
    """A square steel rod."""
    return f"{{type: rod, length: {length}, material: steel, {SQUARE}}}"


def where(result, point):
    """Positions (N, 2) of a point."""
    return path(result, point).position


def velocity(result, point):
    """Velocities (N, 2) of a point."""
    return path(result, point).velocity


def angle(result, part):
    """Angles (N,) of a part."""
    return result.poses[:, result.part_names.index(part), 2]


def speed(result, part):
    """Angular speeds (N,) of a part."""
    return result.rates[:, result.part_names.index(part), 2]


def total_energy(result):
    """Kinetic and stored energy (N,) in J."""
    return result.energy.kinetic + result.energy.stored


def exact_accelerations(result, i, places=()):
    """Accelerations (parts, 3) that Newton's law gives for sample i."""
    mechanism = build_mechanism(result.scene)
    q, v = result.poses[i], result.rates[i]
    return accelerations(mechanism, q, v, np.asarray(places, dtype=float), float(result.time[i]))


def on_grid(result, values, interval):
    """Values at the even samples alone, without those at events."""
    number = np.round(result.time / interval)
    even = np.flatnonzero(abs(result.time / interval - number) < 1e-6)
    return values[even[np.unique(number[even], return_index=True)[1]]]


def impulses(result, name):
    """Ends of contact `name`: events with impulse and energy lost."""
    return [e for e in result.events if e.name == name and e.kind != "contact begins"]
