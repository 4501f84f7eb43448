"""The engine Exudyn: nothing of Exudyn leaves this package but a `Result`."""
