"""Parts of `scripts/benchmark.py`: each measures one thing, and prints nothing."""
