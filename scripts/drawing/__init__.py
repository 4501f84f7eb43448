"""Mechanisms drawn at random, as model files."""
