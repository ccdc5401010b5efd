"""Sections 2.1 and 2.3 of the paper: the arm, string, ball and cup under a controller, as a Drake diagram."""
