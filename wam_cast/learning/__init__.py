"""Section 2.4 of the paper: datasets of simulated casts and the forward model that is learned from them."""
