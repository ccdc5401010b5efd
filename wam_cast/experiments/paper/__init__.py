"""Section 3 of the paper: the whole experiment in phases that can be resumed, and its report."""
