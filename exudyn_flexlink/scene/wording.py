"""Pydantic's errors in the words of someone who writes a model file.

`OTHER_WORDS` are synonyms of its keys and types, from textbooks and other programs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from inspect import isclass
from typing import Any, get_args

from pydantic import ValidationError

from exudyn_flexlink.expressions import looks_like_expression
from exudyn_flexlink.quantities import in_words
from exudyn_flexlink.scene.base import TAG, Part, types_of
from exudyn_flexlink.source import KeyPath, Mistake, did_you_mean

OTHER_WORDS: dict[str, str] = {
    # sections
    "title": "name model description",
    "source": "reference author comment",
    "bodies": "links parts members elements masses",
    "joints": "constraints connections connectors pairs kinematic_pairs hinges",
    "springs": "dampers dashpots spring_dampers elasticity",
    "drives": "forces loads motors actuators drivers inputs excitations torques",
    "contacts": "impacts collisions strikes",
    "curves": "paths tracks slots profiles cams",
    "gravity": "g gravitation weight",
    "initial": "initial_conditions initial_values initial_state start state",
    "run": "simulation simulate time",
    "accuracy": "precision error",
    "solver": "integration numerics settings options",
    "outputs": "results watch sensors",
    # types of bodies and of their sections
    "rod": "link bar thin_rod member",
    "rigid": "body rigid_body point_mass particle mass disk disc wheel plate block ball "
    "slider piston cart crank coupler rocker",
    "flexible": "elastic flexible_body flexible_beam beam cable",
    "rectangle": "rect rectangular square box",
    "round": "circle circular fillet fillet_radius corner_radius rounding",
    "general": "pipe tube hollow profile",
    # types of joints
    "revolute": "pin pinned pin_joint hinge hinged pivot rotational rotary rotation turning ball "
    "clutch freewheel",
    "weld": "fixed rigid rigid_joint fixed_joint welded clamp clamped cantilever",
    "slot": "pin_in_slot pin_slot cam track point_on_curve higher_pair",
    "sleeve": "cylindrical guide",
    "gear": "gears gear_pair gearing cogwheel spur mesh rack pinion rack_and_pinion planetary "
    "epicyclic transmission gearbox",
    "belt": "chain pulley pulleys belt_drive chain_drive timing_belt sprocket",
    "prismatic": "slider sliding slide translational translation slide_joint",
    # types of springs, drives, contacts and laws
    "torsional": "torsion rotational rotary angular torsional_spring",
    "linear": "spring damper dashpot coil translational axial linear_spring bungee buffer bumper",
    "rope": "pulley pulleys cable string tether wire chain winch hoist tackle tendon",
    "speed": "motor velocity angular_velocity angular_speed rotation omega rpm",
    "torque": "moment couple motor_torque",
    "motion": "position displacement angle prescribed",
    "point_on_line": "impact stop collision point_line point_segment contact",
    "line_on_curve": "flat flat_faced flat_faced_follower cam tappet flat_follower",
    "point_on_curve": "cam cam_follower point_curve roller_on_curve wall floor ground",
    "penalty": "compliant spring_damper kelvin_voigt elastic soft",
    "hertz": "hertzian johnson radzimovsky cylinder sphere nonlinear_spring",
    "hunt_crossley": "h_c hc huntcrossley",
    "lankarani_nikravesh": "l_n ln lankarani nikravesh",
    "flores": "flores_et_al",
    "gonthier": "gonthier_et_al",
    "impulse": "rigid hard impulsive newton nonsmooth superball poisson_restitution",
    # types of curves
    "circle": "arc circular",
    "line": "segment straight edge face",
    "spline": "points csv interpolated polynomial",
    "joined": "composite chain path",
    "polygon": "polyline polygonal zigzag square triangle ratchet corners",
    # keys of materials, bodies and sections
    "density": "rho",
    "youngs_modulus": "E young young_modulus elastic_modulus modulus",
    "poissons_ratio": "nu poisson poisson_ratio",
    "length": "l L free_length rest_length natural_length l0",
    "width": "w b depth breadth",
    "thickness": "t h height",
    "diameter": "d radius r",
    "area": "A",
    "second_moment": "I Iz inertia second_moment_of_area moment_of_inertia",
    "mass": "m",
    "inertia": "J I Izz Jz mass_moment mass_moment_of_inertia moment_of_inertia moi",
    "centre_of_mass": "com cog cg center_of_mass centre_of_gravity center_of_gravity s",
    "points": "markers nodes bodies between point1 point_a from of vertices corners data",
    "rods": "n segments elements number_of_rods",
    "hinges": "springs stiffness damping",
    # keys of joints, springs, drives and contacts
    "at": "position place location anchor ground_point origin",
    "point": "points at on body",
    "curve": "path track slot profile",
    "angle": "phi theta rotation",
    "axis": "direction along",
    "ratio": "gear_ratio transmission_ratio i",
    "teeth": "number_of_teeth tooth z N",
    "internal": "ring inner annulus",
    "radii": "radius diameters r curvature",
    "clearance": "gap play backlash",
    "backlash": "lash play clearance gap tooth_play free_play lost_motion",
    "link": "rod slider",
    "over": "points via path eyes pulleys sheaves",
    "joint": "at on joints",
    "stiffness": "k spring_constant spring_rate",
    "damping": "c d damping_coefficient viscosity",
    "damping_ratio": "zeta D",
    "frequency": "f eigenfrequency natural_frequency",
    "rest_angle": "free_angle natural_angle zero_angle phi0",
    "value": "speed torque omega moment magnitude amplitude velocity angular_velocity",
    "ramp": "ramp_time rise_time run_up",
    "tangential_restitution": "et e_t tangential_cor beta superball",
    "restitution": "e cor epsilon coefficient_of_restitution restitution_coefficient",
    "friction": "mu friction_coefficient coulomb dry_friction stiction friction_torque "
    "friction_force",
    "coefficient": "mu mu_dynamic mu_static friction_coefficient coulomb",
    "freewheel": "clutch one_way one_way_clutch overrunning overrunning_clutch backstop sprag "
    "ratchet diode",
    "slip_speed": "stiction_trans_vel v_s vs",
    "exponent": "n power",
    "formula": "model shape",
    "transition_speed": "v0 v_s characteristic_speed",
    "centre": "center c position at",
    "radius": "r diameter",
    "semi_axes": "axes a semiaxes",
    "from": "start first points min minimum lower lower_limit",
    "to": "end last until max maximum upper upper_limit",
    "limits": "limit stop stops end_stop end_stops bounds range joint_limits",
    "acts": "one_sided unilateral side only tension_only compression_only",
    "preload": "pretension prestress initial_tension pre_tension F0",
    "force": "load point_force thrust tension table",
    "closed": "cyclic periodic",
    # keys of the state at time 0, of the run and of its accuracy
    "positions": "position places q x",
    "along": "displacements lengths slides",
    "speeds_along": "sliding_speeds slide_speeds linear_speeds",
    "angles": "angle phi theta rotations",
    "guesses": "guess initial_guess",
    "at_rest": "equilibrium static statics rest static_equilibrium from_rest",
    "speeds": "omega angular_velocities angular_velocity angular_speeds rates",
    "velocities": "velocity v linear_velocities",
    "duration": "time t_end tend end end_time stop seconds",
    "stages": "phases events changes release break latch switch",
    "remove": "release break delete drop detach open disconnect",
    "set": "change values switch",
    "add": "attach connect latch close",
    "until": "when at trigger event stop_when end_when stop_condition end_condition terminate",
    "turns": "revolutions rotations laps",
    "sample": "dt output_step interval sampling sampling_interval",
    "tolerance": "tol atol rtol error accuracy",
    "step": "dt h time_step timestep step_size",
    "formulation": "coordinates",
    "integrator": "method scheme",
    "watch": "point observe output",
}
"""For each word of a model file: words of the field with the same, or a similar, meaning."""


def did_you_mean_word(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" if a known word has the meaning of this one, or resembles it."""
    known, words = list(known), {word, word.lower().replace("-", "_").replace(" ", "_")}
    meant = next((n for n in known if words & set(OTHER_WORDS.get(n, "").split())), None)
    return f"; did you mean '{meant}'?" if meant else did_you_mean(word, known)


_NOWHERE: Mapping[str, str] = {}


def mistakes_of(
    error: ValidationError,
    annotation: Any,
    data: Any,
    place: KeyPath,
    elsewhere: Mapping[str, str] = _NOWHERE,
) -> list[Mistake]:
    """Return the mistakes in `data` at the path `place`; `annotation` is its type in a valid file.

    `elsewhere` maps keys of other sections to these sections: an unknown key may belong there.
    """
    mistakes: list[Mistake] = []
    suggested: set[tuple[KeyPath, str]] = set()
    missing: list[Mistake] = []
    for item in error.errors(include_url=False):
        if item["type"] == "too_short" and len(item["input"]) >= item["ctx"]["min_length"]:
            continue  # pydantic counts valid entries only; the others are reported already
        inner = _data_path(item["loc"])
        path = (*place, *inner)
        if item["type"] == "extra_forbidden":
            keys = known_keys(annotation, data, inner[:-1])
            mistake = unknown_key(path, keys, elsewhere if path[:-1] == place else _NOWHERE)
            mistakes.append(mistake)
            suggested |= {(path[:-1], key) for key in keys if f"'{key}'?" in mistake.message}
        elif item["type"] == "missing":
            missing.append(Mistake(path[:-1], f"missing '{path[-1]}'", on_key=True))
        else:
            mistakes.append(_reworded(path, dict(item)))
    # A misspelt key is one mistake, not also a missing one.
    misspelt = {(path, f"missing '{key}'") for path, key in suggested}
    return mistakes + [item for item in missing if (item.path, item.message) not in misspelt]


def unknown_key(path: KeyPath, keys: list[str], elsewhere: Mapping[str, str] = _NOWHERE) -> Mistake:
    """Return the mistake for a key that is not among `keys`; another section may have it."""
    name = str(path[-1])
    near = f"; did you mean '{elsewhere[name]}.{name}'?" if name in elsewhere else ""
    message = f"unknown key '{name}'{near or did_you_mean_word(name, keys)}"
    return Mistake(path, message, "keys here: " + ", ".join(keys), on_key=True)


def known_keys(annotation: Any, data: Any, path: KeyPath) -> list[str]:
    """Return the keys that may stand in the mapping at `path` of `data`."""
    classes = part_classes(annotation)
    for step in path:
        if isinstance(data, Mapping) and classes:
            fields = _fields(_meant(classes, data))
            # A step that is not a key is the name of a part in a mapping of parts.
            classes = part_classes(fields[str(step)]) if step in fields else classes
        data = data[step]
    return list(_fields(_meant(classes, data))) if classes else []


def _data_path(location: tuple[int | str, ...]) -> KeyPath:
    """Drop the branches of unions from pydantic's location: they are not in the data."""
    return tuple(step for step in location if not str(step).startswith(TAG))


def part_classes(annotation: Any) -> list[type[Part]]:
    """Return the classes of parts in an annotation."""
    if isclass(annotation) and issubclass(annotation, Part):
        return [annotation]
    return [part for inner in get_args(annotation) for part in part_classes(inner)]


def _meant(classes: list[type[Part]], data: Any) -> type[Part]:
    kind = data.get("type") if isinstance(data, Mapping) else None
    return next((part for part in classes if kind in types_of(part)), classes[0])


def _fields(part: type[Part]) -> dict[str, Any]:
    """Return the keys of a part with their annotations."""
    return {field.alias or key: field.annotation for key, field in part.model_fields.items()}


def _reworded(path: KeyPath, error: dict[str, Any]) -> Mistake:
    kind, context, got = error["type"], error.get("ctx", {}), in_words(error["input"])
    if kind == "mistake":
        message = context["message"]
        on_key = not context["at"] and message.startswith(("missing", "needs '"))
        hint, value = context["hint"], error["input"]
        given = isinstance(value, str) and path[0] != "drives" and looks_like_expression(value)
        if given and message.startswith("expected"):
            message += ": an expression can't stand here"
            hint = "it can in the value of a drive"
        return Mistake((*path, *context["at"]), message, hint, on_key=on_key)
    if kind.startswith("union_tag"):
        return _wrong_type(path, error)
    if kind in _WORDS:
        of_file = path[-1:] == ("points",) and isinstance(error["input"], str)
        hint = f"those of a file: 'file: {error['input']}' in place of 'points'" if of_file else ""
        listed = ", ".join(_quoted(str(context.get("expected", ""))))
        entries = "entry" if context.get("min_length") == 1 else "entries"
        wording = _WORDS[kind].format(got=got, listed=listed, entries=entries, **context)
        return Mistake(path, wording, hint)
    return Mistake(path, error["msg"])


def _wrong_type(path: KeyPath, error: dict[str, Any]) -> Mistake:
    data, context = error["input"], error.get("ctx", {})
    types = [word for word in _quoted(context.get("expected_tags", "")) if word]
    listed = ", ".join(types)
    if not isinstance(data, Mapping):
        return Mistake(path, f"expected a mapping with a type, got {in_words(data)}")
    if "type" not in data:
        return Mistake(path, "missing 'type'", f"one of {listed}", on_key=True)
    kind = data["type"]
    near = did_you_mean_word(kind, types) if isinstance(kind, str) else ""
    message = f"type must be one of {listed}; got {in_words(kind)}{near}"
    return Mistake((*path, "type"), message)


def _quoted(text: str) -> list[str]:
    return [word.replace(r"\x00", "") for word in re.findall(r"'([^']*)'", text)]


_WORDS = {
    **dict.fromkeys(("tuple_type", "list_type"), "expected a list, got {got}"),
    **dict.fromkeys(
        ("dict_type", "mapping_type", "model_type", "model_attributes_type"),
        "expected a mapping, got {got}",
    ),
    **dict.fromkeys(
        ("int_type", "int_from_float", "int_parsing_size"), "expected a whole number, got {got}"
    ),
    "string_type": "expected a text, got {got}",
    "bool_type": "expected true or false, got {got}",
    "literal_error": "must be one of {listed}; got {got}",
    "greater_than_equal": "must be {ge} or greater",
    "less_than_equal": "must be {le} or less",
    "too_short": "needs at least {min_length} {entries}",
}
"""Texts for pydantic's other errors, with their context and the value."""
