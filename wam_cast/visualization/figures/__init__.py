"""The figures: each function takes plain data and the axes to draw into, and draws; it computes nothing and opens no files.

Make the figure within `wam_cast.visualization.style.figure_style`, and store it with
`wam_cast.visualization.picture_files.write_figure`.
Lengths come in metres and durations in seconds, and are shown in the unit that the axis names. Docstrings leave out `axes`.
"""
