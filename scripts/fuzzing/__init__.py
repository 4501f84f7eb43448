"""What the loader is fuzzed with: see `scripts/fuzz_loader.py`."""
