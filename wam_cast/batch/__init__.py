"""The contact-free phase of thousands of casts at once, with derivatives, by JAX. No Drake in it."""
