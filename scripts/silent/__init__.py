"""What `scripts/random_silent.py` draws: closed forms, and scenes that are held against them."""
