"""Pictures, films, replays and pages of casts."""
