"""The engine Exudyn: nothing of Exudyn leaves this package but a `Result`."""

from exudyn_flexlink.engines.exudyn.run import formulations, run
