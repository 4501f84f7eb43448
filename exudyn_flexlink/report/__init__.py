"""What the program says of a model and of a run: for people, as text or tables; no files."""

from exudyn_flexlink.report.accuracy import accuracy_text, recommendation
from exudyn_flexlink.report.check import check_text, run_duration
from exudyn_flexlink.report.comparison import comparison_text, excess_text, horizon_text
from exudyn_flexlink.report.contacts import guide_facts, guide_table, pair_table, touch_table
from exudyn_flexlink.report.forces import peak_table
from exudyn_flexlink.report.parts import effects_table
from exudyn_flexlink.report.run import (
    cost_table,
    energy_table,
    error_table,
    failure_text,
    idle_settings,
    positions_text,
    run_force_errors,
    run_text,
)
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
