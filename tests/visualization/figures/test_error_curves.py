"""Error curves: centimetres over logarithmic axes, and the marks where they belong."""

import numpy as np

from wam_cast.visualization.figures.estimator_figures import draw_error_curve

SIGMA = np.array([0.1, 1.0, 10.0])
RMSE = np.array([0.02, 0.002, np.nan])


def test_curves_path_and_marks_are_where_they_belong(axes, line_of, legend_of):
    curves = {"validation": RMSE, "leave-one-out": 2 * RMSE}
    descents = [
        (np.array([0.5, 0.8]), np.array([0.01, 0.003])),
        (np.array([3.0, 0.9]), np.array([0.02, 0.004])),
    ]
    chosen = {"leave-one-out": 0.8, "validation": 0.35}
    draw_error_curve(axes, SIGMA, curves, xlabel="σ [1]", descents=descents, chosen=chosen)
    marks = ["chosen by leave-one-out: 0.8", "chosen by validation: 0.35"]
    assert legend_of(axes) == ["validation", "leave-one-out", "descents", *marks]
    np.testing.assert_allclose(line_of(axes, "validation"), np.column_stack([SIGMA, [2, 0.2, np.nan]]))
    np.testing.assert_allclose(line_of(axes, "leave-one-out")[:, 1], [4, 0.4, np.nan])
    np.testing.assert_allclose(line_of(axes, "descents"), [[0.5, 1.0], [0.8, 0.3]])
    np.testing.assert_allclose(line_of(axes, "_"), [[3.0, 2.0], [0.9, 0.4]])
    np.testing.assert_allclose(line_of(axes, marks[0])[:, 0], 0.8)
    np.testing.assert_allclose(line_of(axes, marks[1])[:, 0], 0.35)
    drawn = [line for line in axes.get_legend().get_lines() if line.get_marker() == "None"][-2:]
    assert len({str(line._unscaled_dash_pattern) for line in drawn}) == 2
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("σ [1]", "RMSE [cm]")


def test_marks_are_left_out_unless_given(axes, legend_of):
    draw_error_curve(axes, SIGMA, {"validation": RMSE}, xlabel="σ [1]")
    assert legend_of(axes) == ["validation"]


def test_one_descent_is_called_so_and_the_legend_hides_nothing(
    axes, line_of, legend_of, assert_hides_nothing
):
    draw_error_curve(
        axes,
        SIGMA,
        {"validation": RMSE},
        xlabel="σ [1]",
        descents=[(SIGMA, RMSE)],
        chosen={"validation": 1.0},
    )
    assert legend_of(axes) == ["validation", "descent", "chosen by validation: 1"]
    assert_hides_nothing(axes)


def test_ticks_of_a_few_decades_are_plain_numbers(axes, texts_of):
    draw_error_curve(axes, SIGMA, {"validation": np.array([0.02, 0.002, 0.001])}, xlabel="σ [1]")
    ticks = {text.get_text() for text, _ in texts_of(axes.figure)}
    assert {"0.1", "1", "10", "0.2", "2"} <= ticks


def test_ticks_of_many_decades_are_powers(axes, texts_of):
    draw_error_curve(axes, np.array([1e-12, 1e-6, 1e-1]), {"validation": RMSE}, xlabel="λ [1]")
    assert any("10^{-" in text.get_text() for text, _ in texts_of(axes.figure))
