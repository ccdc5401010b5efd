"""The cast as environments for learners: `wam_cast/Cast-v0` and `wam_cast/CastTorque-v0` of Gymnasium's registry.

To import this package registers them; so does `gymnasium.make("wam_cast.environments:wam_cast/Cast-v0")`. Neither loads Drake
before one of them is made.
"""

from importlib.util import find_spec

from wam_cast.errors import InputError

if find_spec("gymnasium") is None:
    raise InputError('the environments lack their package; install it with `pip install "wam_cast[gymnasium]"`')

from gymnasium import register, registry

TIME_LIMIT = 2500
"""Steps after which an episode of `wam_cast/CastTorque-v0` is truncated: 5 s at the reference scenario's 500 Hz."""

_HERE = "wam_cast.environments"

if "wam_cast/Cast-v0" not in registry:
    register(
        id="wam_cast/Cast-v0",
        entry_point=f"{_HERE}.cast_env:CastEnv",
        vector_entry_point=f"{_HERE}.cast_vector_env:CastVectorEnv",
    )
    register(id="wam_cast/CastTorque-v0", entry_point=f"{_HERE}.torque_env:CastTorqueEnv", max_episode_steps=TIME_LIMIT)
