"""What the program says of a model and of a run: text for people, no files, no terminal."""

from exudyn_flexlink.report.accuracy import accuracy_text, recommendation
from exudyn_flexlink.report.check import check_text, estimated_steps, run_duration
from exudyn_flexlink.report.comparison import comparison_text, excess_text, horizon_text
from exudyn_flexlink.report.idle_settings import idle_settings
from exudyn_flexlink.report.run import failure_text, run_text
from exudyn_flexlink.report.sensitivity import sensitivity_text
from exudyn_flexlink.report.sweep import sweep_text
from exudyn_flexlink.report.verification import (
    verification_data,
    verification_markdown,
    verification_text,
)

__all__ = [
    "accuracy_text",
    "check_text",
    "comparison_text",
    "estimated_steps",
    "excess_text",
    "failure_text",
    "horizon_text",
    "idle_settings",
    "recommendation",
    "run_duration",
    "run_text",
    "sensitivity_text",
    "sweep_text",
    "verification_data",
    "verification_markdown",
    "verification_text",
]
