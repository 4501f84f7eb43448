"""What the program says of a model and of a run: for people, as text or tables; no files."""

from exudyn_flexlink.report.accuracy import accuracy_text, recommendation
from exudyn_flexlink.report.check import check_text, estimated_steps, run_duration
from exudyn_flexlink.report.comparison import comparison_text, excess_text, horizon_text
from exudyn_flexlink.report.contacts import guide_facts, guide_table, pair_table, touch_table
from exudyn_flexlink.report.effects import effects_table
from exudyn_flexlink.report.energy import energy_table
from exudyn_flexlink.report.forces import peak_table
from exudyn_flexlink.report.idle_settings import idle_settings
from exudyn_flexlink.report.run import (
    cost_table,
    error_table,
    failure_text,
    positions_text,
    run_force_errors,
    run_text,
)
from exudyn_flexlink.report.sensitivity import sensitivity_text
from exudyn_flexlink.report.stability import doubted_text, exponent_text, stability_text
from exudyn_flexlink.report.strikes import response_table, strike_table
from exudyn_flexlink.report.sweep import sweep_text
from exudyn_flexlink.report.tables import Table
from exudyn_flexlink.report.text import listed, number
from exudyn_flexlink.report.verification import (
    verification_data,
    verification_markdown,
    verification_text,
)

__all__ = [
    "Table",
    "accuracy_text",
    "check_text",
    "comparison_text",
    "cost_table",
    "doubted_text",
    "effects_table",
    "energy_table",
    "error_table",
    "estimated_steps",
    "excess_text",
    "exponent_text",
    "failure_text",
    "guide_facts",
    "guide_table",
    "horizon_text",
    "idle_settings",
    "listed",
    "number",
    "pair_table",
    "peak_table",
    "positions_text",
    "recommendation",
    "response_table",
    "run_duration",
    "run_force_errors",
    "run_text",
    "sensitivity_text",
    "stability_text",
    "strike_table",
    "sweep_text",
    "touch_table",
    "verification_data",
    "verification_markdown",
    "verification_text",
]
