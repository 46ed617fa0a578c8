"""The viewer's process: who may come in, and that the loop waits for nothing that it does."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import msgspec
import numpy as np
import pytest
import viser
from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect

from iapb.scene import find_scene, load_scene
from reference.worlds import find_world
from reports.live import browser
from reports.live.device import live_simulation
from reports.live.replay import replay
from reports.live.viewer import SpringHand, Viewer
from reports.live.window import SHOWN, SILENCE_SECONDS, TARGET, WANTED, Window
from reports.store.keys import content_hash

pytestmark = pytest.mark.thorough

TICKS = 60


@pytest.fixture(scope="module")
def peg():
    """Make a simulation of the peg as the scene has it, or with other values."""
    scene = load_scene(find_scene("peg_corner"))
    return lambda **values: live_simulation(scene.with_values(values), find_world("IAPB"), 1000.0)


@pytest.fixture(scope="module")
def viewer(peg):
    shown = Viewer(peg(), port=18080)
    shown.address = shown.start()
    yield shown
    name = shown.window.name
    shown.close()
    assert not shown.process.is_alive()
    with pytest.raises(FileNotFoundError):
        Window(3, name)


def status(address, **headers):
    """HTTP status of a page."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=20) as page:
            return page.status
    except urllib.error.HTTPError as error:
        return error.code


def opened(address, origin):
    """Whether the server takes a web socket from a page of this origin."""
    try:
        with connect(address, origin=origin, subprotocols=[f"viser-v{viser.__version__}"]) as socket:
            return len(socket.recv(timeout=20)) > 0
    except InvalidHandshake:
        return False


def test_nobody_comes_in_without_the_word_in_the_address_nor_from_another_website(viewer):
    place = urlsplit(viewer.address)
    root = f"http://{place.netloc}"
    with urllib.request.urlopen(viewer.address, timeout=20) as page:
        assert page.status == 200 and b"<html" in page.read().lower()
        assert page.headers["X-Frame-Options"] == "DENY" and page.headers["Referrer-Policy"] == "no-referrer"
    assert len(place.path) > 20 and root.startswith("http://127.0.0.1:")
    assert status(viewer.address, Host=f"localhost:{place.port}") == 200
    for wrong in (root, f"{root}/", f"{root}/x{place.path}", f"{root}/?{place.path}", viewer.address[:-2]):
        assert status(wrong) == 403, wrong
    for host in ("evil.example", f"evil.example:{place.port}", "127.0.0.1", f"127.0.0.1.evil.example:{place.port}"):
        assert status(viewer.address, Host=host) == 403, host  # a name of theirs that leads to this machine
    assert status(viewer.address, Origin="https://evil.example") == 403
    address = viewer.address.replace("http:", "ws:").rstrip("/")
    assert opened(address, root)
    for origin in ("https://evil.example", "null", None, f"http://127.0.0.1:{place.port + 1}", root + ".evil.example"):
        assert not opened(address, origin), origin
    for wrong in (f"ws://{place.netloc}", address[:-1], address + "x"):
        assert not opened(wrong, root), wrong


def test_a_viser_that_starts_its_server_in_another_way_is_refused():
    with pytest.raises(RuntimeError, match="unguarded"), browser._guarded("word"):
        pass


NONSENSE = [(np.inf, 0.0, 0.0), (np.nan, 0.0, 0.0), (1e308, 0.0, 0.0), (1.0, 2.0), "far", None, (1.0, None, 2.0),
            {"x": 1.0}, {"x": 1.0, "y": 0.0, "z": 0.0}]


def test_a_client_that_sends_nonsense_lets_go_and_ends_neither_viewer_nor_hand(viewer):
    place, frames = urlsplit(viewer.address), 3 / browser.FRAMES_PER_SECOND
    options = {"origin": f"http://{place.netloc}", "subprotocols": [f"viser-v{viser.__version__}"]}

    def send(position, held):
        message = {"type": "TransformControlsUpdateMessage", "name": "/hand", "wxyz": (1.0, 0.0, 0.0, 0.0)}
        socket.send(msgspec.msgpack.encode(message | {"position": position}))
        end = time.monotonic() + 20.0
        while (viewer.window.target(time.monotonic(), None) is not None) is not held:
            assert time.monotonic() < end
            time.sleep(0.02)

    for nonsense in NONSENSE:
        with connect(viewer.address.replace("http:", "ws:").rstrip("/"), **options) as socket:
            send((0.01, -0.02, 0.0), held=True)
            send(nonsense, held=False)
            time.sleep(frames)
    assert viewer.process.is_alive()


def test_it_says_nothing_of_a_connection_that_asks_nothing_nor_of_ctrl_c_nor_of_its_end(peg, capfd):
    shown = Viewer(peg(), port=18090)
    address = shown.start()
    with connect(address.replace("http:", "ws:").rstrip("/"), origin=address[: address.rindex("/", 0, -1)],
                 subprotocols=[f"viser-v{viser.__version__}"]) as client:
        for position in ([[1.0], [2.0, 3.0]], "\x1b[31m", 5):  # viser would print these, with tracebacks
            client.send(msgspec.msgpack.encode({"type": "TransformControlsUpdateMessage", "name": "/hand",
                                                "wxyz": (1.0, 0.0, 0.0, 0.0), "position": position}))
    with socket.create_connection(("127.0.0.1", urlsplit(address).port)) as connection:
        connection.sendall(b"GET /\xff/ HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert b"403" in connection.recv(4096).splitlines()[0]
    for sent in (b"", b"neither HTTP nor a web socket\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", urlsplit(address).port)) as connection:
            connection.sendall(sent)
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(4096):  # until the server has done with it
                pass
    os.kill(shown.process.pid, signal.SIGINT)
    assert status(address) == 200
    shown.close()
    assert shown.process.exitcode == -signal.SIGTERM  # and not of the SIGINT
    assert capfd.readouterr().err == ""


def test_the_loop_waits_for_no_viewer_that_sleeps_is_silent_or_has_died(viewer, peg, fake_clock, lived):
    def paced(started=100.0):
        simulation, clock = peg(), fake_clock()
        viewer._hand, clock.time = SpringHand(simulation), started
        live, _ = lived(simulation, TICKS, clock, audience=viewer)
        assert live.run.complete and not live.timetable.missed.any()
        return live, live.timetable.rows[:, 4:]

    os.kill(viewer.process.pid, signal.SIGSTOP)
    try:
        viewer.window.page[WANTED] = 0  # it may have been stopped while writing
        viewer.window.want(np.array([0.0, -0.013, 0.0]), 100.0)  # in its place: the mouse pulls the peg to the wall
        pulled, wrench = paced()
        assert np.all(wrench[:, 0] < peg().scene.hand.force[0])
        assert content_hash(replay(pulled)) == content_hash(pulled.run)
        alone, free = paced(100.0 + 2.0 * SILENCE_SECONDS)
        assert np.array_equal(free, np.tile(free[0], (TICKS, 1))) and np.any(free != wrench)
        assert viewer.window.shown()[:2] == pytest.approx(alone.run.pose[-1, 0, :2], abs=0.0)
    finally:
        os.kill(viewer.process.pid, signal.SIGCONT)
    os.kill(viewer.process.pid, signal.SIGKILL)
    viewer.process.join(10.0)
    paced()


def test_the_mouse_brings_a_free_tool_to_the_target_with_less_than_its_limit_and_lets_go(peg):
    simulation = peg(**{"bodies.peg.velocity": [0, 0, 0], "bodies.peg.position": [0.4, -0.4, 0.0],
                        "hand.force": [0.1, 0, 0]})  # fmt: skip
    hand, target = SpringHand(simulation), np.array([0.38, -0.43, 0.5])  # planar: its height does not count
    own, gaps, forces = simulation.port.wrench.copy(), [], []
    assert hand.point() == pytest.approx([0.4, -0.4, 0.0])
    for _ in range(1500):
        simulation.port.wrench[:] = hand.wrench(target) - own
        forces.append(simulation.port.wrench.copy())
        simulation.step()
        gaps.append(np.linalg.norm(target[:2] - simulation.state.q[:2]))
    assert gaps[-1] < 0.02 * gaps[0] and max(gaps) <= gaps[0] + 1e-9
    assert np.linalg.norm(forces, axis=1).max() <= hand.limit * (1.0 + 1e-12) and not np.any(np.array(forces)[:, 2:])
    assert np.array_equal(hand.wrench(None), own)


def test_what_is_read_is_never_half_of_two_writes_and_who_died_while_writing_is_not_waited_for():
    ours, now = Window(4), 5.0
    theirs, stop, read = Window(4, ours.name), threading.Event(), []

    def write():
        k = 0.0
        while not stop.is_set():
            k += 1.0
            ours.publish(np.full(4, k))

    writer = threading.Thread(target=write)
    writer.start()
    read = [pose for pose in (theirs.shown() for _ in range(3000)) if pose is not None]
    stop.set()
    writer.join()
    assert read and all(np.all(pose == pose[0]) for pose in read)
    assert ours.target(now, None) is None
    theirs.want(np.array([0.1, 0.2, 0.3]), now)
    before = ours.target(now, None)
    assert before.tolist() == [0.1, 0.2, 0.3]
    theirs.page[WANTED] += 1  # it begins to write, and that was that
    theirs.page[TARGET] = 9.0
    assert ours.target(now, before) is before
    assert ours.target(now + 1.01 * SILENCE_SECONDS, before) is None  # the hand lets go
    theirs.page[WANTED] += 1
    theirs.want(None, now)
    assert ours.target(now, before) is None
    ours.page[SHOWN] += 1
    assert theirs.shown() is None
    theirs.close()
    ours.close()
