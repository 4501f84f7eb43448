"""What the program says of a model and of a run: for people, as text or tables; no files."""

from exudyn_flexlink.report.check import check_text, run_duration
from exudyn_flexlink.report.parts import effects_table, equilibrium_text, rest_text
from exudyn_flexlink.report.run import (
    bending_table,
    cost_table,
    energy_table,
    error_table,
    failure_text,
    friction_table,
    guide_facts,
    guide_table,
    idle_settings,
    pair_table,
    peak_table,
    positions_text,
    response_table,
    run_force_errors,
    run_text,
    strike_table,
    touch_table,
)
from exudyn_flexlink.report.studies import (
    accuracy_text,
    against_text,
    comparison_text,
    doubted_text,
    excess_text,
    exponent_text,
    fit_text,
    horizon_text,
    recommendation,
    stability_text,
    sweep_text,
    verification_data,
    verification_markdown,
    verification_text,
)
from exudyn_flexlink.report.text import Table, listed, number
