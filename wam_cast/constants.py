"""Constants of nature."""

GRAVITY = 9.81
"""Drake's default [m/s^2]."""
