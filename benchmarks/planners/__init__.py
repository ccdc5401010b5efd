"""Planners side by side: those of the package and black-box searches, over the same cups and at equal numbers of evaluations."""
