"""The figures of the report: each function takes plain data and axes, and draws; it computes nothing and opens no files.

Make the figure and store it within `wam_cast.evaluation.style.figure_style`. Lengths come in metres and durations in seconds,
and are shown in the unit that the axis names.
"""
