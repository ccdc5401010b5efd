"""Exercises for classrooms: what tells a right answer from a wrong one, and what grades a folder of submissions."""
