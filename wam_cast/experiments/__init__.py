"""Casts planned and executed by the hundred: trials, the map of the floor, the paper's experiment."""
