"""A forward model from nothing but the scenario's numbers."""
