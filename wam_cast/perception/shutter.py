"""Shutter: what stands between a camera's lens and its picture: the exposure, which blurs what moves, and the pixels' noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import AbstractParameterIndex, Context, EventStatus, State
from pydrake.systems.sensors import ImageRgba8U

from wam_cast.motion.noise_draws import Source, random_stream
from wam_cast.robot.drake_types import evaluate, held, weakly
from wam_cast.robot.python_system import PythonSystem
from wam_cast.scenario import Cameras

FULL_SCALE = 255

BLUR_STEP = 0.001
"""An exposure is the mean of pictures at most so far apart [s]: a ball that falls at 2 m/s gets 2 mm farther."""

MOST_CAMERAS = 2
"""Whose noise is drawn apart."""


@dataclass(frozen=True, eq=False)
class Exposure:
    """What has come through the shutter: the sum of the pictures of this frame, shape (height, width, 3), and frames begun."""

    light: NDArray[np.float32]
    n_begun: int


class Shutter(PythonSystem):
    """Makes of the pictures of a perfect camera those of a real one, a frame each period.

    A frame is the mean of what was seen while the shutter was open, which is at frame k from `start + k * period - exposure / 2`
    on. From `start + k * period + exposure / 2` on its picture is there. The pixels' noise is a pure function of the noise seed, an
    abstract parameter of the context, and of the frame's number.

    Ports: color_image -> picture; both are `ImageRgba8U`.

    Parameters
    ----------
    cameras
        What the pictures are like.
    which
        Number of the camera, 0 or 1: each has noise of its own.
    start
        Of frame 0 [s]; later than half an exposure.
    """

    def __init__(self, cameras: Cameras, which: int, start: float) -> None:
        super().__init__()
        self._noise, self._which = FULL_SCALE * cameras.pixel_noise, which
        shape = (cameras.height, cameras.width)
        self._n_steps = max(1, math.ceil(cameras.exposure / BLUR_STEP - 1e-9))
        self._input = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(cameras.width, cameras.height)))
        dark = Exposure(np.zeros((*shape, 3), dtype=np.float32), 0)
        self._exposure = self.DeclareAbstractState(AbstractValue.Make(dark))
        for step in range(self._n_steps):
            since = cameras.exposure * ((step + 0.5) / self._n_steps - 0.5)
            update = self._open if step == 0 else self._go_on
            self.DeclarePeriodicUnrestrictedUpdateEvent(1 / cameras.frame_rate, start + since, update)
        # A Python object, since a number of Drake's could not hold every integer.
        self._seed = self.DeclareAbstractParameter(Value[object](0))
        seed = self.abstract_parameter_ticket(AbstractParameterIndex(self._seed))
        # Not weakly, the port would keep the system for ever. The stubs want a function of any two objects.
        calc: Any = weakly(self._calc_picture)
        self.DeclareAbstractOutputPort(
            "picture",
            lambda: Value(ImageRgba8U(cameras.width, cameras.height)),
            calc,
            {self.abstract_state_ticket(self._exposure), seed},
        )

    def set_seed(self, context: Context, noise_seed: int) -> None:
        """Set the noise seed in this system's own `context`: the same one gives the same pictures."""
        context.get_mutable_abstract_parameter(self._seed).set_value(noise_seed)

    def _open(self, context: Context, state: State) -> EventStatus:
        return self._expose(context, state, is_first=True)

    def _go_on(self, context: Context, state: State) -> EventStatus:
        return self._expose(context, state, is_first=False)

    def _expose(self, context: Context, state: State, *, is_first: bool) -> EventStatus:
        seen = evaluate(self._input, context).data[..., :3].astype(np.float32)
        before: Exposure = held(context.get_abstract_state(int(self._exposure)))
        exposure = Exposure(seen if is_first else before.light + seen, before.n_begun + is_first)
        state.get_mutable_abstract_state(int(self._exposure)).set_value(exposure)
        return EventStatus.Succeeded()

    def _calc_picture(self, context: Context, output: AbstractValue) -> None:
        exposure: Exposure = held(context.get_abstract_state(int(self._exposure)))
        light = exposure.light / self._n_steps
        if self._noise > 0:
            seed = held(context.get_abstract_parameter(self._seed))
            rng = random_stream(seed, Source.PIXELS, MOST_CAMERAS * exposure.n_begun + self._which)
            light = light + np.float32(self._noise) * rng.standard_normal(light.shape, dtype=np.float32)
        pixels = held(output).mutable_data
        pixels[..., :3] = np.clip(np.rint(light), 0, FULL_SCALE)
        pixels[..., 3] = FULL_SCALE
