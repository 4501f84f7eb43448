"""What the program says of a model and of a run: for people, as text or tables; no files."""

from exudyn_flexlink.report.accuracy import accuracy_text, recommendation
from exudyn_flexlink.report.check import check_text, run_duration
from exudyn_flexlink.report.comparison import comparison_text, excess_text, horizon_text
from exudyn_flexlink.report.contacts import (
    guide_facts,
    guide_table,
    pair_table,
    peak_table,
    response_table,
    strike_table,
    touch_table,
)
from exudyn_flexlink.report.equilibrium import equilibrium_text, rest_told
from exudyn_flexlink.report.fits import against_text, fit_text
from exudyn_flexlink.report.parts import effects_table
from exudyn_flexlink.report.run import (
    cost_table,
    energy_table,
    error_table,
    failure_text,
    friction_table,
    idle_settings,
    positions_text,
    run_force_errors,
    run_text,
)
from exudyn_flexlink.report.studies import (
    doubted_text,
    exponent_text,
    stability_text,
    sweep_text,
    verification_data,
    verification_markdown,
    verification_text,
)
from exudyn_flexlink.report.text import Table, listed, number
