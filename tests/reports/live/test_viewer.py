"""The viewer's process: it serves, it is held, and stopped or killed it costs the loop nothing but the picture."""

from __future__ import annotations

import os
import signal
import socket
import time
import urllib.error
import urllib.request
from types import SimpleNamespace
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
from reports.live.loop import Loop
from reports.live.replay import replay
from reports.live.viewer import SpringHand, Viewer
from reports.live.window import SILENCE_SECONDS, WANTED, Window
from reports.store.keys import content_hash

TICKS = 60


@pytest.fixture(scope="module")
def peg():
    """Make a simulation of the peg as the scene has it."""
    return lambda: live_simulation(load_scene(find_scene("peg_corner")), find_world("IAPB"), 1000.0)


@pytest.fixture(scope="module")
def viewer(peg):
    shown = Viewer(peg(), port=18080)
    shown.address = shown.start()
    yield shown
    name = shown.window.name
    shown.stop()
    assert not shown.process.is_alive()
    with pytest.raises(FileNotFoundError):
        Window(3, name)


def paced(viewer, simulation, clock):
    """A loop with the viewer's process as it is, and the hand of this simulation."""
    viewer._hand = SpringHand(simulation)
    return Loop(simulation, TICKS, clock, audience=viewer).run("IAPB")


def status(address, **headers):
    """HTTP status of a page."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=20) as page:
            return page.status
    except urllib.error.HTTPError as error:
        return error.code


def test_nobody_comes_in_without_the_word_in_the_address_nor_under_another_name_of_the_machine(viewer):
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


def opened(address, origin):
    """Whether the server takes a web socket from a page of this origin."""
    try:
        with connect(address, origin=origin, subprotocols=[f"viser-v{viser.__version__}"]) as socket:
            return len(socket.recv(timeout=20)) > 0
    except InvalidHandshake:
        return False


def test_no_other_website_opens_the_web_socket_that_moves_the_hand(viewer):
    place = urlsplit(viewer.address)
    address, own = viewer.address.replace("http:", "ws:").rstrip("/"), f"http://{place.netloc}"
    assert opened(address, own)
    for origin in ("https://evil.example", "null", None, f"http://127.0.0.1:{place.port + 1}", own + ".evil.example"):
        assert not opened(address, origin), origin
    for wrong in (f"ws://{place.netloc}", address[:-1], address + "x"):
        assert not opened(wrong, own), wrong


@pytest.mark.parametrize("place", [(np.inf, 0.0, 0.0), (np.nan, 0.0, 0.0), (1e308, 0.0, 0.0), (1.0, 2.0), {"x": 1.0},
                                   "far", None, (1.0, None, 2.0), (True, False, True)], ids=str)
def test_a_drag_to_where_no_mouse_can_be_lets_go(place):
    handle = SimpleNamespace(on_update=lambda moved: None, position=np.zeros(3))
    server = SimpleNamespace(scene=SimpleNamespace(add_transform_controls=lambda *_, **__: handle),
                             on_client_disconnect=lambda gone: None)
    mouse = browser.Mouse(server, 1.0, spatial=True)

    def dragged(to):
        mouse.moved(SimpleNamespace(phase="update", target=SimpleNamespace(position=np.array(to))))
        return mouse.target_at(time.monotonic())

    assert dragged((1.0, 2, 3.0)).tolist() == [1.0, 2.0, 3.0] and dragged(place) is None
    assert dragged((1.0, 2.0, 3.0)) is not None
    assert mouse.target_at(time.monotonic() + 0.9 * browser.HOLD_SECONDS) is not None
    assert mouse.target_at(time.monotonic() + 1.1 * browser.HOLD_SECONDS) is None and mouse.target is None


@pytest.mark.parametrize("nonsense", [(np.inf, 0.0, 0.0), (1e308, 0.0, 0.0), (1.0, 2.0), {"x": 1.0},
                                      {"x": 1.0, "y": 0.0, "z": 0.0}], ids=str)
def test_a_client_that_sends_nonsense_ends_neither_viewer_nor_hand(viewer, nonsense):
    place, frames = urlsplit(viewer.address), 3 / browser.FRAMES_PER_SECOND
    options = {"origin": f"http://{place.netloc}", "subprotocols": [f"viser-v{viser.__version__}"]}

    def send(position, held):
        message = {"type": "TransformControlsUpdateMessage", "name": "/hand", "wxyz": (1.0, 0.0, 0.0, 0.0)}
        socket.send(msgspec.msgpack.encode(message | {"position": position}))
        end = time.monotonic() + 20.0
        while (viewer.window.target(time.monotonic(), None) is not None) is not held:
            assert time.monotonic() < end
            time.sleep(0.02)

    for _ in range(2):
        with connect(viewer.address.replace("http:", "ws:").rstrip("/"), **options) as socket:
            send((0.01, -0.02, 0.0), held=True)
            send(nonsense, held=False)
            time.sleep(frames)
    assert viewer.process.is_alive()


def test_a_viser_that_starts_its_server_in_another_way_is_refused():
    with pytest.raises(RuntimeError, match="unguarded"), browser._guarded("word"):
        pass


def test_it_says_nothing_of_a_connection_that_asks_nothing_nor_of_ctrl_c_nor_of_its_end(peg, capfd):
    shown = Viewer(peg(), port=18090)
    address = shown.start()
    port = urlsplit(address).port
    for sent in (b"", b"neither HTTP nor a web socket\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(sent)
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(4096):  # until the server has done with it
                pass
    os.kill(shown.process.pid, signal.SIGINT)
    with urllib.request.urlopen(address, timeout=20) as page:
        assert page.status == 200
    shown.stop()
    assert shown.process.exitcode == -signal.SIGTERM  # and not of the SIGINT
    assert capfd.readouterr().err == ""


def test_the_loop_does_not_wait_for_a_viewer_that_sleeps_and_lets_go_for_one_that_is_silent(
    viewer, peg, fake_clock
):
    os.kill(viewer.process.pid, signal.SIGSTOP)
    try:
        target = np.array([0.0, -0.013, 0.0])
        viewer.window.page[WANTED] = 0  # it may have been stopped while writing
        viewer.window.want(target, 100.0)  # in the sleeper's place: the mouse pulls the peg to the wall
        clock = fake_clock()
        pulled = paced(viewer, peg(), clock)
        assert pulled.run.steps == TICKS and not pulled.timetable.missed.any()
        assert np.all(pulled.timetable.wrench[:, 0] < peg().scene.hand.force[0])
        assert content_hash(replay(pulled)) == content_hash(pulled.run)
        clock = fake_clock()
        clock.time += 2.0 * SILENCE_SECONDS
        alone = paced(viewer, peg(), clock)
        assert np.array_equal(alone.timetable.wrench, np.tile(alone.timetable.wrench[0], (TICKS, 1)))
        assert np.any(alone.timetable.wrench != pulled.timetable.wrench)
        assert viewer.window.shown()[:2] == pytest.approx(alone.run.pose[-1, 0, :2], abs=0.0)
    finally:
        os.kill(viewer.process.pid, signal.SIGCONT)


def test_the_loop_does_not_notice_that_the_viewer_has_died(viewer, peg, fake_clock):
    os.kill(viewer.process.pid, signal.SIGKILL)
    viewer.process.join(10.0)
    live = paced(viewer, peg(), fake_clock())
    assert live.run.complete and not live.timetable.missed.any()
