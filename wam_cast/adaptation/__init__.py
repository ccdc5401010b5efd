"""Robots that nobody told the planner about: drawn at random, they only answer casts, and models learn from a few answers."""
