"""What `scripts/hard_cases.py` is made of: cases, their truths, and what judges a run."""
