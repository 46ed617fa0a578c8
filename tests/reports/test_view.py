"""A scene in real time: the loop with a made-up page and clock, the command, and the real page."""

import json
import os
import signal
import time

import msgspec
import numpy as np
import pytest
import viser
from websockets.datastructures import Headers
from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect

from iapb.scene import find_scene, load_scene, scene_names
from iapb.simulation import Simulation
from iapb.worlds import find_world
from reference.worlds import run_world
from reports.cli import main
from reports.store.keys import content_hash
from reports.store.runs import read_entry, read_run
from reports.view.guard import allowed
from reports.view.loop import PULLED, TICK, Pull, spring, watch
from reports.view.page import Page
from reports.view.shapes import solids

PEG = load_scene(find_scene("peg_corner"))
AWAY = np.array([0.04, -0.04, 0.0])  # [m] from the corner, into the open
CORNER = np.array([0.0105, 0.00525, 0.0])  # [m] of the peg


def simulation_of(scene=PEG):
    """A simulation in the world IAPB."""
    world = find_world("IAPB")
    return Simulation(scene, world.law, world.coupling_in(scene))


class Clock:
    """Time passes only while the loop sleeps, and by `work` [s] in each tick, by its number."""

    def __init__(self, work=None):
        self.now = 100.0
        self.ticks = 0
        self.work = work or {}

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


class Script:
    """A page that follows a script: from tick to pull, and from tick to what happens then."""

    def __init__(self, pulls=None, acts=None, closes=None, clock=None):
        self.pulls = pulls or {}
        self.acts = acts or {}
        self.closes = closes
        self.clock = clock
        self.pull = self.pulls.get(0)
        self.shown = []

    def show(self, poses):
        self.shown.append(poses)
        tick = len(self.shown)
        self.pull = self.pulls.get(tick, self.pull)
        self.acts.get(tick, lambda: None)()
        if self.clock is not None:
            self.clock.now += self.clock.work.get(tick, 0.0)

    def is_open(self):
        return len(self.shown) != self.closes


def test_a_scene_that_nobody_pulls_runs_as_without_a_page_in_the_time_of_the_clock():
    page = Script()
    clock = Clock()
    seen = watch(simulation_of(), "IAPB", 0.5, page, clock)
    assert (seen.late, seen.latest, seen.run.remarks) == (0, 0.0, ())
    assert clock.now == pytest.approx(100.5)
    assert content_hash(seen.run) == content_hash(
        run_world(PEG.with_values({"duration": 0.5}), "IAPB")
    )


def test_the_mouse_pulls_the_tool_by_a_weak_spring_until_it_lets_go():
    released = 1000  # two steps a tick
    pulls = {0: Pull(np.zeros(3), AWAY), released // 2: None}
    run = watch(simulation_of(), "IAPB", 2.5, Script(pulls), Clock()).run
    own = np.array(PEG.hand.force)
    before = run.hand_force[:released] - own
    assert np.all(run.hand_force[released:] == own) and np.all(before.any(axis=1))
    most = 2.0 * 1.0 + np.hypot(*own[:2])  # 1 m/s² of 2 kg, and against the hand of the scene
    assert np.hypot(*before[:, :2].T).max() == pytest.approx(most)
    stiffness = 2.0 * (4.0 * np.pi) ** 2
    assert run.q[released, :2] == pytest.approx(AWAY[:2] + own[:2] / stiffness, abs=5e-4)
    assert run.remarks == (PULLED,) and run.complete


def test_a_pull_at_the_corner_turns_the_tool():
    """By the arm of the corner, and along the pull by a spring of 2 Hz on the mass felt there."""
    simulation = simulation_of()
    simulation.state.v[:] = 0.0
    x, y, angle = simulation.state.q
    arm = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ CORNER[:2]
    target = np.array([x + arm[0], y + arm[1] + 1e-4, 0.0])  # less than the limit needs
    force = spring(simulation, Pull(CORNER, target), np.zeros(6))
    mobility = 1.0 / 2.0 + arm @ arm / 0.005  # along the direction in which it is largest
    pulled = 1e-4 * (4.0 * np.pi) ** 2 / mobility
    assert force[[0, 1, 5]] == pytest.approx([0.0, pulled, arm[0] * pulled])


def test_late_steps_are_counted_and_put_off_what_comes_after():
    clock = Clock({3: 10e-3, 5: TICK})
    page = Script(clock=clock)
    seen = watch(simulation_of(), "IAPB", 0.1, page, clock)
    tick = 2 / 512
    assert seen.late == 4 and seen.latest == pytest.approx(10e-3 - tick)
    assert clock.now == pytest.approx(100.0 + round(0.1 * 512) / 512 + 10e-3 - tick + TICK - tick)


def test_a_closed_page_ctrl_c_or_a_step_that_fails_ends_it_with_what_was_done():
    handler = signal.getsignal(signal.SIGINT)
    closed = watch(simulation_of(), "IAPB", 10.0, Script(closes=7), Clock()).run
    assert (closed.steps, closed.complete, closed.stopped) == (14, True, "")
    page = Script(acts={5: lambda: os.kill(os.getpid(), signal.SIGINT)})
    assert watch(simulation_of(), "IAPB", 10.0, page, Clock()).run.steps == 10
    assert signal.getsignal(signal.SIGINT) is handler
    fast = {"bodies.peg.velocity": [-0.3, 0.4, 0.0]}
    stiff = PEG.with_values(fast | {"couplings.four_channel.stiffness": [1e9] * 3})
    failed = watch(simulation_of(stiff), "IAPB", 10.0, Script(), Clock()).run
    assert "too long" in failed.stopped and 0 < failed.steps < 5120 and not failed.complete


@pytest.mark.parametrize(("scene", "told"), [("peg_corner", False), ("newton_cradle", True)])
def test_the_command_stores_what_was_seen_and_says_if_nothing_can_be_pulled(
    scene, told, tmp_path, monkeypatch, capsys
):
    class Made(Script):
        address = "http://here/"

        def __init__(self, source, port):
            assert source.name == scene and port == 8080
            super().__init__({5: None if told else Pull(np.zeros(3), AWAY)})

        def wait(self):
            pass

        def close(self):
            pass

    opened = []
    monkeypatch.setattr("reports.commands.view.Page", Made)
    monkeypatch.setattr("webbrowser.open", opened.append)
    status = main(["view", scene, "--seconds", "0.1", "--out", str(tmp_path), "--json"])
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert status == 0 and opened == ["http://here/"] and "Open http://here/" in err
    assert ("nothing can be pulled" in err) is told
    run = read_run(found["file"])
    assert run.steps == found["steps"] > 50 and (PULLED in run.remarks) is not told
    assert read_entry(found["file"]).run_key == ""  # so it is no run of `iapb run`
    assert main(["inspect", found["file"]]) == 0 and run.scene_name in capsys.readouterr().out


HOST = {"Host": "127.0.0.1:80"}
HERE = HOST | {"Origin": "http://127.0.0.1:80", "Upgrade": "websocket"}


@pytest.mark.parametrize(
    ("path", "headers", "expected"),
    [
        ("/word/", HOST, True),
        ("/word/?x", HERE, True),
        ("/", HOST, False),
        ("/word/", {}, False),
        ("/word/", {"Host": "evil.example:80"}, False),
        ("/word/", HOST | {"Upgrade": "websocket"}, False),
        ("/word/", HERE | {"Origin": "null"}, False),
        ("/word/", HERE | {"Origin": "http://127.0.0.1:81"}, False),
    ],
    ids=str,
)
def test_only_the_page_itself_reaches_the_server(path, headers, expected):
    assert allowed(path, Headers(headers), 80, "word") is expected


@pytest.fixture
def page():
    """The page of the peg, without a browser."""
    made = Page(PEG, 18080)
    yield made
    made.close()


def test_solids_are_closed_with_their_outside_out_and_where_the_scene_puts_them():
    for name in scene_names():
        for solid in solids(load_scene(find_scene(name)).resolved(), 1.0):
            faces = solid.triangles()
            edges = {(face[i], face[i - 2]) for face in faces.tolist() for i in range(3)}
            assert all((b, a) in edges for a, b in edges)
            volumes = np.linalg.det(solid.corners[faces] - solid.corners.mean(axis=0))
            assert volumes.min() >= -1e-12 * volumes.sum()
    peg, *walls = solids(PEG.resolved(), 1.0)
    assert peg.corners.max(axis=0) == pytest.approx([*CORNER[:2], 0.05])
    [floor] = [wall for wall in walls if wall.corners[:, 1].max() > 5.0]  # y is down
    assert floor.corners[:, 1].min() == pytest.approx(0.0)


def dragged(phase, start, end):
    """What a browser sends of a drag."""
    return msgspec.msgpack.encode(
        {
            "type": "SceneNodeDragMessage",
            "phase": phase,
            "name": "/peg/0",
            "instance_index": None,
            "start_position": start,
            "start_screen_pos": (0.5, 0.5),
            "end_position": end,
            "end_screen_pos": (0.5, 0.5),
            "button": "left",
            "modifier": None,
            "owner": "",
        }
    )


# A browser counts from its first camera on.
CAMERA = msgspec.msgpack.encode(
    {
        "type": "ViewerCameraMessage",
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (0.0, 0.0, 1.0),
        "fov": 1.0,
        "near": 0.01,
        "far": 10.0,
        "image_height": 480,
        "image_width": 640,
        "look_at": (0.0, 0.0, 0.0),
        "up_direction": (0.0, 1.0, 0.0),
    }
)


def eventually(holds):
    """Wait until it holds."""
    end = time.monotonic() + 20.0
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.thorough
def test_a_drag_pulls_the_gripped_point_of_the_tool_and_a_browser_that_goes_closes_the_page(page):
    root = page.address.rsplit("/", 2)[0]
    socket = page.address.replace("http:", "ws:")
    protocol = [f"viser-v{viser.__version__}"]
    with pytest.raises(InvalidHandshake):
        connect(socket, origin="https://evil.example", subprotocols=protocol)
    assert not page.is_open()
    half = np.sqrt(0.5)
    page.show(np.array([[0.02, -0.01, 0.0, 0.0, 0.0, half, half]]))  # turned by a right angle
    with connect(socket, origin=root, subprotocols=protocol) as client:
        client.send(CAMERA)
        eventually(page._server.get_clients)  # `wait` has no end without one
        page.wait()
        assert page.is_open() and page.pull is None
        grip = (0.02, 0.0, 0.0)
        client.send(dragged("start", grip, grip))
        client.send(dragged("update", grip, (0.1, 0.2, 0.0)))
        eventually(lambda: page.pull is not None and page.pull.target[0] == 0.1)
        assert page.pull.point == pytest.approx([0.01, 0.0, 0.0])
        assert page.pull.target == pytest.approx([0.1, 0.2, 0.0])
        client.send(dragged("update", grip, (np.nan, 0.2, 0.0)))
        eventually(lambda: page.pull is None)
        client.send(dragged("start", grip, (0.1, 0.2, 0.0)))
        eventually(lambda: page.pull is not None)
        client.send(dragged("end", grip, (0.1, 0.2, 0.0)))
        eventually(lambda: page.pull is None)
    eventually(lambda: not page.is_open())
