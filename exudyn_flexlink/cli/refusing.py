"""Errors by which a command refuses what it is asked for: it ends with exit code 2."""

from __future__ import annotations

from argparse import ArgumentTypeError

from exudyn_flexlink.loading import ImpossibleLengthError
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import StorageError

REFUSALS = (ArgumentTypeError, ImpossibleLengthError, SceneError, StorageError)
"""Options that can't be, models with mistakes, places that can't be read or written."""
