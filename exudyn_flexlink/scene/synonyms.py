"""Words that textbooks and other programs use for what a model file calls by another name."""

from __future__ import annotations

from collections.abc import Iterable

from exudyn_flexlink.source import did_you_mean

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
    "round": "circle circular",
    "general": "pipe tube hollow profile",
    # types of joints
    "revolute": "pin pinned pin_joint hinge hinged pivot rotational rotary rotation turning ball",
    "weld": "fixed rigid rigid_joint fixed_joint welded clamp clamped cantilever",
    "slot": "pin_in_slot pin_slot cam track point_on_curve higher_pair",
    "sleeve": "cylindrical guide",
    "gear": "gears gear_pair gearing cogwheel spur mesh rack pinion rack_and_pinion planetary "
    "epicyclic transmission gearbox",
    "belt": "chain pulley pulleys belt_drive chain_drive timing_belt sprocket",
    "prismatic": "slider sliding slide translational translation slide_joint",
    # types of springs, drives, contacts and laws
    "torsional": "torsion rotational rotary angular torsional_spring",
    "linear": "spring damper dashpot coil translational axial linear_spring rope cable string "
    "tether bungee buffer bumper",
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
    "joined": "composite chain polyline path",
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
    "points": "markers nodes bodies between point1 point_a from of vertices data",
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
    "link": "rod slider",
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
    "duration": "time t_end tend end end_time stop until seconds",
    "turns": "revolutions rotations laps",
    "sample": "dt output_step interval sampling sampling_interval",
    "tolerance": "tol atol rtol error accuracy",
    "step": "dt h time_step timestep step_size",
    "formulation": "coordinates",
    "integrator": "method scheme",
    "watch": "point observe output",
}
"""For each word of a model file, words that mean the same, or something near, in the field."""


def did_you_mean_word(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" if one of the known words means, or resembles, this one."""
    known = list(known)
    meant = next((name for name in known if _means(name, word)), None)
    return f"; did you mean '{meant}'?" if meant else did_you_mean(word, known)


def _means(name: str, word: str) -> bool:
    others = OTHER_WORDS.get(name, "").split()
    return word in others or word.lower().replace("-", "_").replace(" ", "_") in others
