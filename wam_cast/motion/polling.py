"""At which samples a cast is looked at, and what is taken from what is seen there: the same in every engine."""

from __future__ import annotations

POLL_PERIODS = 10
"""Control periods between two polls of the ball."""

CONTACT_POLL_PERIODS = 3
"""The same near the cup; longer than an impact, so that a ball at an impact's turning point does not pass for one at rest."""

TRACKING_SAMPLES = 10
"""Samples between two at which the tracking error is computed; in between it cannot change much."""

SLACK_MARGIN = 0.005
"""The string is slack when hand and ball are closer than its length by more than this share of it."""

MAX_BALL_SPEED = 100.0
"""A ball that is faster [m/s] belongs to a simulation that diverges."""

MAX_STATE = 1e3
"""So does a joint's angle [rad] or speed [rad/s] beyond this."""
