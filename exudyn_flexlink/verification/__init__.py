"""Runs of benchmarks held against numbers that others published.

A benchmark is a model and, beside it, a file ``<name>.published.yaml`` with the numbers. Nothing
here runs an engine: who verifies gives the results.
"""

from exudyn_flexlink.verification.judging import (
    Benchmark,
    Compared,
    VerifiedRun,
    judged,
    read_benchmark,
)
