"""The page of a scene: viser draws its shapes in the browser, and the mouse pulls the tool."""

from __future__ import annotations

import secrets
import time
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of, start_of
from reports.view.guard import HOST, guarded
from reports.view.loop import Pull
from reports.view.shapes import extent, solids

Floats = NDArray[np.float64]

GONE_SECONDS = 2.0  # without a browser until the page counts as closed; loading it again is faster
_FRAME_SECONDS = 1.0 / 30.0
_LOAD_SECONDS = 1.0  # from the first connection until the browser shows the scene
_BODY = (120, 144, 170)
_TOOL = (214, 120, 60)
_WALL = (170, 170, 165)
# of the camera, in sizes of the scene
_FRONT = (0.0, 0.0, 2.2)
_SIDE = (0.87, -1.0, 0.43)


class Page:
    """The page of a scene, served to this machine only.

    Parameters
    ----------
    source : the scene that it shows.
    port : of the server; if it is taken, the next free one.

    Attributes
    ----------
    address : where a browser finds it; it has a random word in it.
    pull : what the mouse pulls now.
    """

    def __init__(self, source: Scene, port: int) -> None:
        import viser

        scene = source.resolved()
        word = secrets.token_urlsafe(16)
        with guarded(word), redirect_stdout(StringIO()):  # it prints an address without the word
            self._server = viser.ViserServer(HOST, port, f"iapb · {scene['name']}", verbose=False)
        self._server.gui.configure_theme(show_share_button=False)
        self.address = f"http://{HOST}:{self._server.get_port()}/{word}/"
        self.pull: Pull | None = None
        self._shown = self._seen = 0.0  # when the last frame was sent, and when a browser was there
        start = mechanism_of(source).poses(start_of(source)[0][None], planar=False)[0]
        size = self._look(scene, start)
        add = self._server.scene
        names = [body["name"] for body in scene["bodies"]]
        self._frames = {name: add.add_frame(f"/{name}", show_axes=False) for name in names}
        tool = (scene.get("hand") or {}).get("body")
        for number, solid in enumerate(solids(scene, size)):
            vertices = solid.corners.astype(np.float32)
            faces = solid.triangles()
            color = _TOOL if solid.body == tool else _BODY if solid.body else _WALL
            mesh = add.add_mesh_simple(
                f"/{solid.body or 'world'}/{number}", vertices, faces, color=color, side="double"
            )
            if solid.body == tool:
                mesh.on_drag("left")(self._drag)
        self._tool: Any = self._frames.get(tool)

    def wait(self) -> None:
        """Wait until a browser shows the scene."""
        while not self._server.get_clients():
            time.sleep(_FRAME_SECONDS)
        time.sleep(_LOAD_SECONDS)
        self._seen = time.monotonic()

    def is_open(self) -> bool:
        """Return whether a browser shows the page, or did a moment ago."""
        now = time.monotonic()
        if self._server.get_clients():
            self._seen = now
        else:
            self.pull = None
        return now - self._seen < GONE_SECONDS

    def show(self, poses: Floats) -> None:
        """Show the bodies at their poses (bodies, 7), thirty times a second at most."""
        now = time.monotonic()
        if now - self._shown < _FRAME_SECONDS:
            return
        self._shown = now
        with self._server.atomic():
            for frame, pose in zip(self._frames.values(), poses, strict=True):
                frame.position = pose[:3]
                frame.wxyz = pose[[6, 3, 4, 5]]

    def close(self) -> None:
        """Stop the server."""
        with redirect_stdout(StringIO()):
            self._server.stop()

    async def _drag(self, event: Any) -> None:
        """Pull the tool where the mouse gripped it.

        Viser may exchange the order of two events for a plain function, but not for this coroutine.
        """
        if event.phase == "start":
            turn = Rotation.from_quat(self._tool.wxyz, scalar_first=True).inv()
            self._grip = turn.apply(np.array(event.start_position) - self._tool.position)
        is_held = event.phase != "end" and np.all(np.isfinite([*self._grip, *event.end_position]))
        self.pull = Pull(self._grip, np.array(event.end_position)) if is_held else None

    def _look(self, scene: dict[str, Any], start: Floats) -> float:
        """Set the camera: planar scenes from the front, others from the side, z up; return the size
        of the scene [m]."""
        low, high = extent(scene, start)
        size = float(np.linalg.norm(high - low))
        turned = scene["name"].startswith("peg_")  # the paper's frame: x to the left and y down
        up = (0.0, -1.0 if turned else 1.0, 0.0)
        towards = _FRONT
        if scene.get("dimensions") == 3:
            up = (0.0, 0.0, 1.0)
            towards = _SIDE
        camera = self._server.initial_camera
        camera.up = up
        camera.look_at = 0.5 * (low + high)
        camera.position = camera.look_at + size * np.array(towards)
        camera.near = 0.01 * size
        self._server.scene.set_up_direction(up)
        return size
