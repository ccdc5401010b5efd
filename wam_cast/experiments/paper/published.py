"""The numbers of section 3 of the paper, in SI units."""

N_TRAIN, N_VALIDATION, N_TEST = 1300, 300, 100

SIGMA = 0.35
"""Of its kernel; it does not say whether the parameters were scaled."""

TEST_RMSE = 0.0224
"""Of its kernel regression [m]."""

POLYNOMIAL_DEGREE = 12
"""The best one, it says."""

POLYNOMIAL_RMSE = 0.217
"""Of that polynomial on the test casts [m]."""

PREDICTED_MISS = 0.0085
"""Mean over its cups [m]."""

N_MISSED = 2
"""Cups."""

MISSED_PREDICTED, MISSED_EXECUTED = 0.02, 0.05
"""Predicted and executed miss of these two [m]; the balls had bounced off the rim."""

HIT_RATE = 0.9
"""Of its abstract."""

PLANNER_STOP = 0.01
"""Predicted miss at which its planner is content [m]."""

CUP_RADIUS = 0.03
"""Inner radius of its cup [m]."""
