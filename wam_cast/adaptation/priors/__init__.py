"""What is believed of how a robot differs, before its first cast."""
