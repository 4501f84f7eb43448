"""Reports on a model, a run and studies: texts, tables and documents."""

from exudyn_flexlink.report.check import check_text, run_duration
from exudyn_flexlink.report.comparing import (
    against_document,
    against_text,
    comparison_document,
    comparison_text,
    excess_text,
    fit_document,
    fit_text,
    horizon_text,
)
from exudyn_flexlink.report.parts import effects_table, equilibrium_text, linear_text, rest_text
from exudyn_flexlink.report.run import (
    TOTALS,
    bending_peak_columns,
    bending_table,
    cost_table,
    energy_table,
    error_table,
    failure_text,
    friction_columns,
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
    accuracy_document,
    accuracy_text,
    doubted_text,
    exponent_text,
    recommendation,
    sensitivity_text,
    stability_document,
    stability_text,
    sweep_text,
    verification_data,
    verification_markdown,
    verification_text,
)
from exudyn_flexlink.report.text import Document, Table, entries, number
