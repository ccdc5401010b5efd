"""Casts in formats that others read and write: MCAP, and tables of what a real robot measured."""
