"""Section 2.2 of the paper: the staged motion of the hand, as pure functions of time and cast; no Drake."""
