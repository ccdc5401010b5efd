"""The experiment on robots that nobody told it about."""
