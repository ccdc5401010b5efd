"""The contact-free phase of thousands of casts at once, with derivatives, by JAX. No Drake in it."""

from importlib.util import find_spec

from wam_cast.errors import InputError

if find_spec("jax") is None:
    raise InputError('the batched engine lacks its packages; install them with `pip install "wam_cast[batch]"`')
