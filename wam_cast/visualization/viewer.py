"""What all Meshcat pages of a cast share: a plain background, a camera that sees all of it, and tubes for paths."""

from __future__ import annotations

import ipaddress
import logging
import math
import socket
import threading

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatParams, Rgba

from wam_cast.errors import InputError, quoted, shortened
from wam_cast.types import Array
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.style import PAPER, Color

TURN, ELEVATION = math.radians(28), math.radians(8)
"""Of the page's first view: see `.view_rotation`."""

FIELD_OF_VIEW = math.radians(30)
"""Of the page's camera, vertically."""

N_SIDES = 4
"""Of a tube."""

BALL_PATH_RADIUS, HAND_PATH_RADIUS = 0.003, 0.002
"""Of the tubes that show paths [m]: Meshcat's own lines are one pixel wide in browsers."""

RING_SPACING = 0.008
"""From one ring of a tube to the next, along the path [m]."""


ALL_INTERFACES = "*"
"""The host of a page that whoever reaches this machine can open; Drake's own default."""

LOWEST_PORT, HIGHEST_PORT = 1024, 65535
"""Which Drake opens; any other ends the process."""


def open_meshcat(host: str = "localhost", port: int = 0) -> Meshcat:
    """Return a Meshcat with a plain background, which does not say where it listens.

    It listens at a `host`, which is this machine alone unless told otherwise (`ALL_INTERFACES`, a name or an address of this
    machine), on a `port`, or for 0 on a free one. Raises `.InputError` if that cannot be.
    """
    _check_host(host)
    if port and not LOWEST_PORT <= port <= HIGHEST_PORT:
        raise InputError(f"port = {quoted(port)} must be from {LOWEST_PORT} to {HIGHEST_PORT}, or 0 for a free one")
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    url = f"http://{_shown(host)}:{{port}}"
    try:
        meshcat = Meshcat(MeshcatParams(host=host, port=port, web_url_pattern=url, show_stats_plot=False))
    except RuntimeError:
        raise InputError(
            f"no page can be served at {shortened(host)}, port {port or 'free'}: another program has the port; choose another, or "
            "0 for a free one"
        ) from None
    finally:
        logger.setLevel(level)
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for color in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background/<object>", color, list(PAPER))
    return meshcat


def _check_host(host: str) -> None:
    """Raise `.InputError` if no page can be served at a host, whatever the port."""
    remedy = f"give localhost, an address of this machine, or {ALL_INTERFACES!r} for all of them"
    if host == ALL_INTERFACES:
        return
    if not host:
        raise InputError(f"host = {quoted(host)} is empty; {remedy}")
    try:
        family, *_, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise InputError(f"host = {quoted(host)} is a name that this machine knows no address of; {remedy}") from None
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind(address)
    except OSError:
        raise InputError(f"host = {quoted(host)} is no address of this machine; {remedy}") from None


def _shown(host: str) -> str:
    """Return how a browser on this machine names a host."""
    try:
        address = ipaddress.ip_address("::" if host == ALL_INTERFACES else host)
    except ValueError:
        return host
    if address.is_unspecified:
        return "localhost"
    return host if address.version == 4 else f"[{host}]"


def is_loopback(host: str) -> bool:
    """Return whether what listens at a `host` can be reached from this machine alone."""
    try:
        found = {entry[4][0] for entry in socket.getaddrinfo(host, None)}
    except (OSError, UnicodeError):
        return False
    return all(ipaddress.ip_address(str(address).partition("%")[0]).is_loopback for address in found)


_kept: list[Meshcat] = []
"""What `keep` was given."""


def keep(meshcat: Meshcat) -> Meshcat:
    """Keep `meshcat` until the process ends, and return it.

    A Meshcat must end in the thread that began it, or Drake aborts the process. What shows its scene is full of cycles, which any
    thread may collect; a notebook's kernel has several. So each costs a port and a thread until then.
    """
    _kept.append(meshcat)
    return meshcat


_free: list[Meshcat] = []
"""What `give_back` was given."""


def take_page() -> Meshcat:
    """Return an empty Meshcat: one that was given back, or a new one. A browser that had its page open shows what comes next."""
    meshcat = _free.pop() if _free else keep(open_meshcat())
    meshcat.Delete()
    return meshcat


def give_back(meshcat: Meshcat) -> None:
    """Let the next one who asks for a page take this one, which listens on: see `keep`."""
    _free.append(meshcat)


def check_main_thread(what: str) -> None:
    """Raise `.InputError` in any thread but the main one, before Drake ends the process or, silently, the thread."""
    if threading.current_thread() is not threading.main_thread():
        raise InputError(
            f"{what}, called in the thread {threading.current_thread().name!r}: its page belongs to the main thread; make it and "
            "call it there"
        )


def place_camera(meshcat: Meshcat, p_WQ: Array, bearing: float, elevation: float = ELEVATION) -> Camera:
    """Look at the casting plane at `bearing`, `elevation` down [rad], such that all points `p_WQ` [m], shape (n, 3), are seen.

    Returns the page's camera in a square window.
    """
    R_WV = view_rotation(bearing, TURN, elevation)
    camera = Camera.framing(p_WQ, R_WV, (1000, 1000), FIELD_OF_VIEW)
    ahead = R_WV[:, 2]
    depth = float(np.mean((p_WQ - camera.p_WV) @ ahead))
    meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=math.degrees(FIELD_OF_VIEW)))
    meshcat.SetCameraPose(camera.p_WV, camera.p_WV + depth * ahead)
    return camera


def draw_tube(meshcat: Meshcat, path: str, p_WQ: Array, radius: float, color: Color) -> None:
    """Put a `tube` at a `path` of Meshcat's tree."""
    meshcat.SetTriangleMesh(path, *tube(p_WQ, radius), Rgba(*color))


def ring_points(points: Array) -> NDArray[np.int_]:
    """Return the indices of the first and the last of `points` [m], shape (n, 3), and of one for each `RING_SPACING` between."""
    travelled = np.cumsum(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1))
    passed = np.diff(np.floor(travelled / RING_SPACING), prepend=-1) > 0
    passed[-1] = True
    return np.flatnonzero(passed)


def tube(p_WQ: Array, radius: float) -> tuple[Array, NDArray[np.int32]]:
    """Return an open tube of `radius` [m] around the path p_WQ [m], shape (n, 3): vertices (3, m) and triangles (3, k).

    Both are in the order of the path, `2 * N_SIDES` triangles from each of its points to the next one.
    """
    along = np.gradient(p_WQ, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    # Of the world's axes the one that the path follows least cannot be parallel to it.
    helper = np.eye(3)[np.argmin(np.abs(along).max(axis=0))]
    side = np.cross(along, helper)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    other = np.cross(along, side)
    angles = 2 * np.pi / N_SIDES * np.arange(N_SIDES)
    rings = p_WQ[:, None] + radius * (
        np.cos(angles)[:, None] * side[:, None] + np.sin(angles)[:, None] * other[:, None]
    )
    index = np.arange(rings.size // 3).reshape(-1, N_SIDES)
    here, there = index[:-1], index[1:]
    quads = np.stack([here, there, np.roll(there, -1, axis=1), np.roll(here, -1, axis=1)], axis=-1)
    triangles = quads[..., [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return np.asfortranarray(rings.reshape(-1, 3).T), np.asfortranarray(triangles.T, dtype=np.int32)
