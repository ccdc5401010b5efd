"""What unknown robots come to."""

import numpy as np
from matplotlib.figure import Figure

from wam_cast.visualization.figures.transfer_figures import draw_hit_rates


def test_panels_beside_each_other_show_all_of_every_interval():
    curves = [np.array([[0.0, 5.0], [0.99, 1.0], [low, low], [0.995, 1.0]]) for low in (0.97, 0.8)]
    figure = Figure()
    for panel, curve in zip(figure.subplots(1, 2, sharey=True), curves, strict=True):
        draw_hit_rates(panel, {"a cup": curve}, title="robots")
    figure.draw_without_rendering()
    lower, upper = panel.get_ylim()
    assert 70 < lower < 80
    assert 100 < upper < 102
