"""Section 2.5 of the paper: from a cup's position to the cast that reaches it."""
