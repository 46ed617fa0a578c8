"""The paced loop under a clock of the tests' own, the run done again; the viewer: who comes in, and nobody waits."""

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
from reference.worlds import find_world, run_world
from reports.cli import main
from reports.live import browser
from reports.live.budget import RowBudget, calibrated
from reports.live.deadline import PERCENTILES
from reports.live.device import live_simulation
from reports.live.loop import Loop
from reports.live.replay import finish_live, is_live, open_parts, read_live, replay
from reports.live.viewer import SpringHand, Viewer
from reports.live.window import SHOWN, SILENCE_SECONDS, TARGET, WANTED, Window
from reports.store.care import parts_of_killed
from reports.store.keys import content_hash
from reports.store.parts import are_damaged

PERIOD = 1e-3
TICKS, FEW = 700, 60  # more than one chunk of the record, and less
# A tilted peg near the corner, fast: a collision of several contacts within the first hundredths of a second.
FAST = {"bodies.peg.position": [0.0209, -0.0141, 0.08], "bodies.peg.velocity": [-0.3, 0.4, 0.0]}


class FakeClock:
    """Time passes by a microsecond each time that it is asked, and by jumps: number of the wait -> seconds too late.

    at : number of the wait -> what happens then
    """

    def __init__(self, jumps=None, at=None, time=100.0):
        self.time, self.jumps, self.waits, self.at = time, jumps or {}, 0, at or {}

    def now(self):
        self.time += 1e-6
        return self.time

    def wait_until(self, instant):
        self.time = max(self.time, instant) + self.jumps.get(self.waits, 0.0)
        self.at.get(self.waits, lambda: None)()
        self.waits += 1


def still(device="", **values):
    """A simulation of the peg as the scene has it, or with other values."""
    scene = load_scene(find_scene("peg_corner")).with_values(values)
    return live_simulation(scene, find_world("IAPB"), 1 / PERIOD, device)


def peg(device="", **values):
    return still(device, **FAST | values)


@pytest.fixture
def lived(tmp_path):
    """Run a loop, and read the files that it comes to: lived(simulation, clock, ticks=TICKS, budget=None, …)."""
    def ran(simulation, clock, *budget, ticks=TICKS, **options):
        parts = open_parts(tmp_path, "live", simulation, "IAPB", ticks)
        stopped = Loop(simulation, ticks, parts, clock, *budget, **options).run()
        path, _, pace = finish_live(parts.folder, stopped, parts.steps)
        parts.close(remove=True)
        return read_live(path), pace

    return ran


def test_a_miss_delays_what_comes_after_and_changes_nothing_in_the_run(lived, monkeypatch):
    monkeypatch.setattr("reports.streaming.HELD", 1)  # a piece for each part
    jumps = {7: 0.4e-3, 50: 2.5e-3, 90: 3.3e-3}  # the first is late, but done in time
    live, pace = lived(peg(), FakeClock(jumps))
    due, start, end = live.timetable.rows[:, :3].T
    assert live.timetable.period == PERIOD
    assert np.all(start >= due) and np.all(end > start) and np.all(start[1:] >= end[:-1])
    assert np.all(due[1:] >= due[:-1] + PERIOD - 1e-12)  # a miss delays, and nothing is hurried
    assert np.flatnonzero(live.timetable.missed).tolist() == [50, 90] and pace.missed == 2
    assert (start - due)[[7, 50, 90]] == pytest.approx([0.4e-3, 2.5e-3, 3.3e-3], abs=1e-4)
    assert pace.behind == pytest.approx(1.5e-3 + 2.3e-3, abs=1e-4)
    assert due[-1] == pytest.approx((TICKS - 1) * PERIOD + pace.behind, abs=1e-9)
    unpaced = run_world(peg().scene.with_values({"duration": TICKS * PERIOD}), "IAPB")
    assert live.run.complete and len(live.run.impacts.step) and content_hash(live.run) == content_hash(unpaced)


@pytest.mark.parametrize("device", ["", "simulated"])
def test_a_run_short_of_time_keeps_to_its_budgets_is_passive_and_repeats_exactly(lived, device):
    simulation = peg(device)
    scarce = RowBudget(0.0, 1.0, PERIOD, simulation.system.mechanism.nv, 1)  # a row takes longer than there is time
    live, pace = lived(simulation, FakeClock({40: 5e-3}), scarce)
    impacts = live.run.impacts
    assert np.all(live.timetable.budget == 1) and len(impacts.step)
    assert np.all(impacts.rank <= live.timetable.budget[impacts.step])
    assert impacts.rows.max() > 1 and pace.rows_left_out > 0
    assert impacts.energy_lost.min() >= 0.0
    assert content_hash(replay(live)) == content_hash(live.run)
    live.timetable.rows[:, 3] = 3  # other budgets, another run
    assert content_hash(replay(live)) != content_hash(live.run)


def test_the_budget_grows_with_the_time_left_between_one_row_and_all_and_every_impact_gets_its_rows(lived):
    budget = RowBudget(2e-4, 1e-5, PERIOD, 30, 2)
    rows = [budget.rows(left) for left in np.linspace(-1e-3, 1e-3, 300)]
    assert rows == sorted(rows) and rows[0] == 1 and rows[-1] == 30 and len(set(rows)) > 5
    before = budget.rows(4e-4)
    budget.learn(3e-4, 1)  # a step took longer than expected
    assert budget.rows(4e-4) < before
    for _ in range(1000):
        budget.learn(1e-4, 0)  # of late they were quick
    assert budget.fixed == pytest.approx(1e-4, rel=1e-3)
    simulation = peg()
    dofs = simulation.system.mechanism.nv
    assert calibrated(simulation, PERIOD).per_row > 0.0
    live, pace = lived(simulation, FakeClock({50: 2.5e-3}), RowBudget(0.0, 1e-6, PERIOD, dofs, 1))
    assert np.all(np.delete(live.timetable.budget, 50) == dofs)
    assert (pace.ticks, pace.missed, pace.rows_left_out) == (TICKS, 1, 0)
    work = live.timetable.rows[:, 2] - live.timetable.rows[:, 1]
    assert pace.work[-1] == work.max() and list(pace.lateness) == sorted(pace.lateness)
    assert pace.work == pytest.approx(np.percentile(work, PERCENTILES), rel=2e-3)


def test_the_budget_learns_from_the_rows_that_were_used(lived):
    told, simulation = [], peg()
    budget = RowBudget(0.0, 1.0, PERIOD, simulation.system.mechanism.nv, 1)
    budget.learn = lambda seconds, rows: told.append(rows)
    impacts = lived(simulation, FakeClock(), budget)[0].run.impacts
    assert sum(told) == impacts.rank.sum() < impacts.rows.sum()


class Fails:
    """A device that works for a while."""

    def __init__(self, device, readings):
        self.device, self.readings, self.told = device, readings, []

    def read(self):
        self.readings -= 1
        if self.readings < 0:
            raise ConnectionError("unplugged")
        return self.device.read()

    def apply(self, force):
        self.told.append(np.array(force))
        self.device.apply(force)


def test_ctrl_c_a_device_that_fails_or_a_motion_without_bounds_ends_the_loop_with_what_was_done(lived):
    before = signal.getsignal(signal.SIGINT)
    live, _ = lived(peg(), FakeClock(at={123: lambda: os.kill(os.getpid(), signal.SIGINT)}))
    assert live.run.steps == 124 == len(live.timetable.due)  # the tick at hand is done to its end
    assert live.run.stopped == "interrupted" and not live.run.complete
    assert content_hash(replay(live)) == content_hash(live.run)
    assert signal.getsignal(signal.SIGINT) is before
    simulation = peg("simulated")
    device = simulation.link.device = Fails(simulation.link.device, 60)
    live, _ = lived(simulation, FakeClock())
    assert live.run.steps == 60 and "unplugged" in live.run.stopped
    assert np.array_equal(device.told[-1], np.zeros(3)) and np.any(device.told[-2])  # it is told to let go
    live, _ = lived(peg(**{"couplings.four_channel.stiffness": [1e9] * 3}), FakeClock())
    assert "too long" in live.run.stopped and 0 < live.run.steps < TICKS


def test_a_live_run_that_is_killed_is_there_up_to_its_last_chunk(tmp_path):
    process = os.fork()
    if process == 0:
        simulation = peg()
        parts = open_parts(tmp_path, "live", simulation, "IAPB", 2000)
        Loop(simulation, 2000, parts, FakeClock(at={1700: lambda: os._exit(9)})).run()
    os.waitpid(process, 0)
    [parts] = parts_of_killed(tmp_path)
    assert is_live(parts)
    stored = read_live(finish_live(parts, "killed")[0])
    assert stored.run.steps == 3 * 512 == len(stored.timetable.due) and stored.run.stopped == "killed"
    assert content_hash(replay(stored)) == content_hash(stored.run)
    last = sorted(parts.glob("*.part"))[-1]
    content = last.read_bytes()
    last.write_bytes(content[: len(content) // 2])
    assert are_damaged(parts) and main(["store", "repair", str(tmp_path)]) == 0 and last.is_file()
    last.write_bytes(content)
    assert main(["store", "repair", str(tmp_path)]) == 0 and not parts.exists()


# The viewer


class Opened(Viewer):
    """A viewer at its address, and what its pages and its web sockets answer."""

    def __init__(self, port):
        super().__init__(still(), port=port)
        self.address = self.start()
        self.place = urlsplit(self.address)
        self.root, self.socket = f"http://{self.place.netloc}", self.address.replace("http:", "ws:").rstrip("/")

    def client(self, address="", **more):
        options = {"origin": self.root, "subprotocols": [f"viser-v{viser.__version__}"]} | more
        return connect(address or self.socket, **options)

    def status(self, address="", **headers):
        """HTTP status of a page."""
        try:
            request = urllib.request.Request(address or self.address, headers=headers)
            with urllib.request.urlopen(request, timeout=20) as page:
                return page.status
        except urllib.error.HTTPError as error:
            return error.code

    def takes(self, address="", **more):
        """Whether the server takes a web socket."""
        try:
            with self.client(address, **more) as client:
                return len(client.recv(timeout=20)) > 0
        except InvalidHandshake:
            return False


def moved(position):
    """What a page sends where the mouse has moved the hand."""
    return msgspec.msgpack.encode({"type": "TransformControlsUpdateMessage", "name": "/hand",
                                   "wxyz": (1.0, 0.0, 0.0, 0.0), "position": position})  # fmt: skip


@pytest.fixture(scope="module")
def viewer():
    shown = Opened(18080)
    yield shown
    name = shown.window.name
    shown.close()
    assert not shown.process.is_alive()
    with pytest.raises(FileNotFoundError):
        Window(3, name)


@pytest.mark.thorough
def test_nobody_comes_in_without_the_word_in_the_address_nor_from_another_website(viewer):
    place, root = viewer.place, viewer.root
    with urllib.request.urlopen(viewer.address, timeout=20) as page:
        assert page.status == 200 and b"<html" in page.read().lower()
        assert page.headers["X-Frame-Options"] == "DENY" and page.headers["Referrer-Policy"] == "no-referrer"
    assert len(place.path) > 20 and root.startswith("http://127.0.0.1:")
    assert viewer.status(Host=f"localhost:{place.port}") == 200
    for wrong in (root, f"{root}/", f"{root}/x{place.path}", f"{root}/?{place.path}", viewer.address[:-2]):
        assert viewer.status(wrong) == 403, wrong
    for host in ("evil.example", f"evil.example:{place.port}", "127.0.0.1", f"127.0.0.1.evil.example:{place.port}"):
        assert viewer.status(Host=host) == 403, host  # a name of theirs that leads to this machine
    assert viewer.status(Origin="https://evil.example") == 403 and viewer.takes()
    for origin in ("https://evil.example", "null", None, f"http://127.0.0.1:{place.port + 1}", root + ".evil.example"):
        assert not viewer.takes(origin=origin), origin
    for wrong in (f"ws://{place.netloc}", viewer.socket[:-1], viewer.socket + "x"):
        assert not viewer.takes(wrong), wrong
    with pytest.raises(RuntimeError, match="unguarded"), browser._guarded("word"):
        pass  # a viser that starts its server in another way is refused


NONSENSE = [(np.inf, 0.0, 0.0), (np.nan, 0.0, 0.0), (1e308, 0.0, 0.0), (1.0, 2.0), "far", None, (1.0, None, 2.0),
            {"x": 1.0}, {"x": 1.0, "y": 0.0, "z": 0.0}]  # fmt: skip


@pytest.mark.thorough
def test_a_client_that_sends_nonsense_lets_go_and_ends_neither_viewer_nor_hand(viewer):
    for nonsense in NONSENSE:
        with viewer.client() as client:
            for position, held in (((0.01, -0.02, 0.0), True), (nonsense, False)):
                client.send(moved(position))
                end = time.monotonic() + 20.0
                while (viewer.window.target(time.monotonic(), None) is not None) is not held:
                    assert time.monotonic() < end
                    time.sleep(0.02)
            time.sleep(3 / browser.FRAMES_PER_SECOND)
    assert viewer.process.is_alive()


@pytest.mark.thorough
def test_it_says_nothing_of_a_connection_that_asks_nothing_nor_of_ctrl_c_nor_of_its_end(capfd):
    shown = Opened(18090)
    with shown.client() as client:
        for position in ([[1.0], [2.0, 3.0]], "\x1b[31m", 5):  # viser would print these, with tracebacks
            client.send(moved(position))
    for sent in (b"GET /\xff/ HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"", b"neither HTTP nor a web socket\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", shown.place.port)) as connection:
            connection.sendall(sent)
            if sent[:3] == b"GET":
                assert b"403" in connection.recv(4096).splitlines()[0]
                continue
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(4096):  # until the server has done with it
                pass
    os.kill(shown.process.pid, signal.SIGINT)
    assert shown.status() == 200
    shown.close()
    assert shown.process.exitcode == -signal.SIGTERM  # and not of the SIGINT
    assert capfd.readouterr().err == ""


@pytest.mark.thorough
def test_the_loop_waits_for_no_viewer_that_sleeps_is_silent_or_has_died(viewer, lived):
    def paced(started=100.0):
        simulation = still()
        viewer._hand = SpringHand(simulation)
        live, _ = lived(simulation, FakeClock(time=started), ticks=FEW, audience=viewer)
        assert live.run.complete and not live.timetable.missed.any()
        return live, live.timetable.rows[:, 4:]

    os.kill(viewer.process.pid, signal.SIGSTOP)
    try:
        viewer.window.page[WANTED] = 0  # it may have been stopped while writing
        viewer.window.want(np.array([0.0, -0.013, 0.0]), 100.0)  # in its place: the mouse pulls the peg to the wall
        pulled, wrench = paced()
        assert np.all(wrench[:, 0] < still().scene.hand.force[0])
        assert content_hash(replay(pulled)) == content_hash(pulled.run)
        alone, free = paced(100.0 + 2.0 * SILENCE_SECONDS)
        assert np.array_equal(free, np.tile(free[0], (FEW, 1))) and np.any(free != wrench)
        assert viewer.window.shown()[:2] == pytest.approx(alone.run.pose[-1, 0, :2], abs=0.0)
    finally:
        os.kill(viewer.process.pid, signal.SIGCONT)
    os.kill(viewer.process.pid, signal.SIGKILL)
    viewer.process.join(10.0)
    paced()


@pytest.mark.thorough
def test_the_mouse_brings_a_free_tool_to_the_target_with_less_than_its_limit_and_lets_go():
    simulation = still(**{"bodies.peg.velocity": [0, 0, 0], "bodies.peg.position": [0.4, -0.4, 0.0],
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


@pytest.mark.thorough
def test_what_is_read_is_never_half_of_two_writes_and_who_died_while_writing_is_not_waited_for():
    ours, now = Window(4), 5.0
    theirs, stop = Window(4, ours.name), threading.Event()

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
