"""A simulated Barrett WAM learns to cast a ball on a string into a cup."""
