"""Sections 2.1 to 2.3 of the paper: the robot as a Drake systems diagram, and casts simulated in it."""
