"""The sections of `benchmarks/speed.py`, a module each."""
