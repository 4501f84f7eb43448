"""Scenes whose touches are short or many, drawn at random, with closed forms of their motion."""
