"""The arm as data: a URDF file, what is needed of a WAM in it, and what a scenario makes of it."""
