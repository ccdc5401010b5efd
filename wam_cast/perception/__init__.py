"""Seeing the ball: cameras, detection, and a filter that knows how a ball on a string moves."""
