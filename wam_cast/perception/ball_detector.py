"""Where the ball is in a picture: the centre of the largest patch of its colour, to a fraction of a pixel."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context
from pydrake.systems.sensors import ImageRgba8U
from scipy import ndimage

from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.plant import BALL_COLOR
from wam_cast.robot.python_system import PythonSystem
from wam_cast.scenario import Cameras
from wam_cast.types import Array

BALL = np.array(BALL_COLOR[:3])

LEAST_REDNESS = 0.05
"""Of a pixel that shows anything of the ball, see `redness`: the floor's is 0.01, the string's 0.11."""

SURE_REDNESS = 1 / 3
"""Of one that shows little else; the ball's own is 0.66."""

DARKEST = 12
"""Sum of a pixel's three values, of 765, below which its colour is noise."""

RIM = 3
"""Width of the frame around a patch in which the background's colour is taken [pixels]."""

LEAST_AREA = 9.0
"""Of a patch that is taken for the ball [pixels]."""


@dataclass(frozen=True)
class Detection:
    """What is seen of the ball in one picture; all nan if nothing is.

    Attributes
    ----------
    column, row
        Of its centre [pixels], counted from the outer corner of the first pixel.
    std
        Standard deviation of each of the two for the pixels' noise alone [pixels].
    radius
        Smaller half axis of the patch [pixels]: the ball's radius, however long the exposure drew it out, unless something hides
        part of it.
    """

    column: float
    row: float
    std: float
    radius: float


UNSEEN = Detection(math.nan, math.nan, math.nan, math.nan)

N_VALUES = 4
"""Of a detection."""


def redness(image: Array) -> Array:
    """Return (R - B) / (R + G + B) of each pixel of an image (height, width, 3), shape (height, width): shade keeps it."""
    total = image.sum(axis=-1)
    return np.where(total > DARKEST, (image[..., 0] - image[..., 2]) / np.maximum(total, 1.0), 0.0)


def detect_ball(image: NDArray[np.uint8], pixel_noise: float = 0.0) -> Detection:
    """Return where the ball is in an image, shape (height, width, 3 or more), from 0 to 255.

    It is the largest patch of the ball's colour; one at the picture's edge is cut off and so is none. Each pixel of it and next to
    it is taken for a mixture: x times the ball's colour, as bright as light and shade make it, and y times that of the background
    around. So 1 - y is its share of the ball, and the ball's centre is that of the shares. `pixel_noise` is the standard deviation
    of a pixel's values, as a fraction of full scale.

    The middle of a sphere's outline is not quite the image of its centre: 0.02 pixels off it at the corner of a picture.
    """
    found = _largest_patch(image)
    if found is None:
        return UNSEEN
    around, patch = found
    share, share_std = _shares(image[around][..., :3].astype(float), patch, 255 * pixel_noise)
    area = float(share.sum())
    if area < LEAST_AREA:
        return UNSEEN
    row, column = np.mgrid[around] + 0.5
    centre = np.array([(share * column).sum(), (share * row).sum()]) / area
    away = np.stack([column - centre[0], row - centre[1]])
    spread = np.einsum("rc,irc,jrc->ij", share, away, away) / area
    radius = 2.0 * math.sqrt(max(float(np.linalg.eigvalsh(spread)[0]), 0.0))
    is_mixed = (share > 0) & (share < 1)  # what noise adds to the others is cut off again
    std = share_std * math.sqrt(float(np.sum((is_mixed * away) ** 2)) / 2) / area
    return Detection(float(centre[0]), float(centre[1]), std, radius)


def _largest_patch(image: NDArray[np.uint8]) -> tuple[tuple[slice, slice], NDArray[np.bool_]] | None:
    """Return the rows and columns around the largest patch of the ball's colour, and its pixels there; none if there is none."""
    # In whole numbers, which are ten times as fast: this is what looks at every pixel.
    red, green, blue = (image[..., i].astype(np.int16) for i in range(3))
    total = red + green + blue
    patches, n_patches = ndimage.label((red - blue > SURE_REDNESS * total) & (total > DARKEST))
    if not n_patches:
        return None
    largest = 1 + int(np.argmax(np.bincount(patches.ravel())[1:]))
    sides = ndimage.find_objects(patches, largest)[largest - 1]
    if any(side.start == 0 or side.stop == size for side, size in zip(sides, patches.shape, strict=True)):
        return None
    rows, columns = (
        slice(max(side.start - RIM, 0), min(side.stop + RIM, size))
        for side, size in zip(sides, patches.shape, strict=True)
    )
    return (rows, columns), patches[rows, columns] == largest


def _shares(pixels: Array, patch: NDArray[np.bool_], noise: float) -> tuple[Array, float]:
    """Return which share of each pixel (height, width, 3) is the ball's, and its standard deviation for noise in the pixels."""
    colour = redness(pixels)
    is_around = colour < LEAST_REDNESS
    background = np.median(pixels[is_around], axis=0) if is_around.any() else np.zeros(3)
    unmix = np.linalg.pinv(np.column_stack([BALL, np.maximum(background, 1.0)]))[1]
    share = np.clip(1.0 - pixels @ unmix, 0.0, 1.0)
    is_near = ndimage.binary_dilation(patch, np.ones((3, 3)))
    share[~is_near | (is_around & ~patch)] = 0.0
    return share, noise * float(np.linalg.norm(unmix))


class BallDetector(PythonSystem):
    """Finds the ball in each picture.

    Ports: picture (`ImageRgba8U`) -> detection (4): a `Detection`'s column, row, std and radius [pixels].
    """

    def __init__(self, cameras: Cameras) -> None:
        super().__init__()
        self._noise = cameras.pixel_noise
        self._input = self.DeclareAbstractInputPort("picture", Value(ImageRgba8U(cameras.width, cameras.height)))
        self.DeclareVectorOutputPort("detection", N_VALUES, self._calc_detection, {self._input.ticket()})

    def _calc_detection(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array(astuple(detect_ball(evaluate(self._input, context).data, self._noise))))
