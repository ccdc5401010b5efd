"""Section 3 of the paper: pictures and replays of casts."""
