"""Casts drawn at random and simulated: a dataset's rows, by one engine or the other."""
