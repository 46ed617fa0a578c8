"""The viewer's process: it shows a scene in a web browser with viser, and offers a handle for the mouse.

Everybody who can open the page can move the hand. Therefore the server listens on this machine only. It answers a
request only if the Host header names this machine and the address contains the random token; a web socket must also
come from the server's own page (Origin header). Other websites in the same browser cannot meet these conditions; they
can neither show the page in a frame nor learn its address from it.
"""

from __future__ import annotations

import hmac
import os
import secrets
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from http import HTTPStatus
from io import StringIO
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from reports.figures.geometry import extent, is_spatial, is_turned, solids
from reports.live.window import Window

Floats = NDArray[np.float64]

HOST = "127.0.0.1"
HOLD_SECONDS = 5.0  # [s] without a movement of the mouse until the hand lets go
FRAMES_PER_SECOND = 30.0

_POLITENESS = 10  # niceness: the loop has priority
_BODY, _TOOL, _WALL = (120, 144, 170), (214, 120, 60), (170, 170, 165)
_DISTANCE = {False: 2.2, True: 1.4}  # of the camera, in sizes of a scene in the plane or in space
_HANDLE_SIZE = 0.25  # of the handle, as a share of the scene's size
_FAR = 1e6  # [m] a mouse is nowhere beyond this
_HEADERS = {"X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}


def show_in_browser(name: str, scene: Mapping[str, Any], port: int, ready: Connection) -> None:
    """Serve the scene (in the viewer's process) with poses from shared memory `name` until the loop's process ends.

    The address is sent through `ready` once the server is running.
    """
    import viser

    os.nice(_POLITENESS)
    parent, names = os.getppid(), [body["name"] for body in scene["bodies"]]
    window = Window(7 * len(names), name)
    token = secrets.token_urlsafe(16)
    with _guarded(token), redirect_stdout(StringIO()):  # the loop's process prints the address
        server = viser.ViserServer(host=HOST, port=port, label=f"iapb · {scene['name']}", verbose=False)
    server.gui.configure_theme(show_share_button=False)
    size, frames = _look(server, scene), [server.scene.add_frame(f"/{body}", show_axes=False) for body in names]
    hand = scene.get("hand") or {}
    for number, piece in enumerate(solids(scene)):
        color = _WALL if not piece.body else _TOOL if piece.body == hand.get("body") else _BODY
        server.scene.add_mesh_simple(f"/{piece.body or 'world'}/shape{number}", piece.vertices.astype(np.float32),
                                     piece.faces.astype(np.uint32), color=color, flat_shading=True, side="double")
    mouse = Mouse(server, _HANDLE_SIZE * size, is_spatial(scene)) if hand else None
    for stream in (1, 2):  # what clients send, or not, would be printed with tracebacks
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    ready.send(f"http://{HOST}:{server.get_port()}/{token}/")
    while os.getppid() == parent:
        started = time.monotonic()
        pose = window.shown()
        if pose is not None and np.all(np.isfinite(pose)):
            with server.atomic():
                for frame, place in zip(frames, pose.reshape(-1, 7), strict=True):
                    frame.position, frame.wxyz = place[:3], place[[6, 3, 4, 5]]
                if mouse is not None:
                    held = pose[7 * names.index(hand["body"]) :][:7]
                    mouse.follow(held[:3] + Rotation.from_quat(held[3:]).apply(np.resize([*hand["point"], 0.0], 3)))
        window.want(None if mouse is None else mouse.target_at(time.monotonic()), time.monotonic())
        time.sleep(max(0.0, started + 1.0 / FRAMES_PER_SECOND - time.monotonic()))
    server.stop()


@contextmanager
def _guarded(token: str) -> Iterator[None]:
    """Make the server that viser starts inside this context refuse every request that is not `allowed`.

    Viser has no option for this, so the start function of its websockets library is replaced meanwhile.

    Raises
    ------
    RuntimeError
        This version of viser started its server in another way, so that requests would not be checked.
    """
    from websockets.asyncio import server

    serve, guarded = server.serve, list[bool]()

    def serve_guarded(*arguments: Any, process_request: Callable[..., Any], **options: Any) -> Any:
        def answer(connection: Any, request: Any) -> Any:
            if not allowed(request.path, request.headers, connection.local_address[1], token):
                return connection.respond(HTTPStatus.FORBIDDEN, "the address that iapb live printed leads here\n")
            request.path = "/" + request.path.removeprefix(f"/{token}").lstrip("/")
            page = process_request(connection, request)
            if page is not None:
                page.headers.update(_HEADERS)
            return page

        guarded.append(True)
        return serve(*arguments, process_request=answer, **options)

    server.serve = serve_guarded  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
    if not guarded:
        raise RuntimeError("viser started its server unguarded: requests would be accepted without the key")


def allowed(path: str, headers: Any, port: int, token: str) -> bool:
    """Return whether a request names this machine, has the token and, for a web socket, comes from the own page."""
    names = [[f"{host}:{port}"] for host in (HOST, "localhost")]
    origins = [[f"http://{name}"] for [name] in names] + ([] if headers.get_all("Upgrade") else [[]])
    word = path.partition("?")[0].split("/")[1:2]
    return (headers.get_all("Host") in names and headers.get_all("Origin") in origins
            and hmac.compare_digest("".join(word).encode(errors="replace"), token.encode()))  # fmt: skip


def _look(server: Any, scene: Mapping[str, Any]) -> float:
    """Set the camera, planar scenes from the front, others from the side, up against gravity; return the size [m]."""
    low, high = extent(scene)
    middle, size, spatial = 0.5 * (low + high), float(np.linalg.norm(high - low)), is_spatial(scene)
    up, towards = np.array([0.0, -1.0 if is_turned(scene) else 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    if spatial:
        gravity = np.asarray(scene.get("gravity") or (0.0, 0.0, -1.0), dtype=float)
        up = -gravity / max(float(np.linalg.norm(gravity)), np.finfo(float).tiny)
        towards = np.array([0.62, -0.72, 0.31])
    camera = server.initial_camera
    camera.up, camera.look_at, camera.position = up, middle, middle + _DISTANCE[spatial] * size * towards
    camera.near = 0.01 * size
    server.scene.set_up_direction(up)
    return size


class Mouse:
    """The handle: it follows the tool until the mouse drags it; then it is the target to which the tool is pulled."""

    def __init__(self, server: Any, size: float, spatial: bool) -> None:
        self.target: Floats | None = None
        self._moved_at = 0.0
        self._handle = server.scene.add_transform_controls(
            "/hand", scale=size, disable_rotations=True, active_axes=(True, True, spatial), depth_test=False)
        self._handle.on_update(self.moved)
        server.on_client_disconnect(self._gone)

    def target_at(self, now: float) -> Floats | None:
        """Return the target of the mouse; None if the mouse has not moved the handle for HOLD_SECONDS."""
        if now - self._moved_at > HOLD_SECONDS:
            self.target = None
        return self.target

    def moved(self, event: Any) -> None:
        """Take the place of the handle as the target; let go for a place that no mouse can reach."""
        self._moved_at, place = time.monotonic(), np.array(event.target.position)
        right = place.shape == (3,) and place.dtype.kind in "if" and bool(np.all(np.abs(place) <= _FAR))
        self.target = place.astype(float) if right and event.phase != "end" else None

    def _gone(self, client: Any) -> None:
        self.target = None  # without a client the mouse holds nothing

    def follow(self, point: Floats) -> None:
        """Move the handle to the held point (3,) of the tool, unless the mouse holds the handle."""
        if self.target is None:
            try:
                self._handle.position = point
            except (TypeError, ValueError):  # a client sent something else, which viser has kept
                self._handle._impl.position = np.zeros(3)
