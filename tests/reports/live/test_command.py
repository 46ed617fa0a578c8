"""`iapb live`: a tenth of a second of real time, its sentences and its files."""

from __future__ import annotations

import numpy as np
import pytest

from reports import cli
from reports.live.replay import read_live, replay
from reports.store.keys import content_hash


@pytest.fixture
def live(capsys, tmp_path):
    """Run `iapb live` with options; return (status, what it printed, what it complained about)."""
    def call(*options):
        return cli.main(["live", "peg_corner", "--out", str(tmp_path), *options]), *capsys.readouterr()

    return call


@pytest.mark.parametrize("device", [(), ("--device", "simulated", "--no-budget")], ids=str)
def test_it_says_how_it_kept_to_the_clock_and_what_it_stored_can_be_done_again(live, tmp_path, device):
    status, out, _ = live("--seconds", "0.1", "--set", "bodies.peg.velocity=[-0.3,0.4,0]", *device)
    assert status == 0
    for text in ("100 ticks at 1000 Hz", "A tick's work took", "It began late by", "deadline", "collision"):
        assert text in out, text
    timetable, path = sorted(tmp_path.glob("*.h5"), key=lambda path: "timetable" not in path.name)
    assert str(path) in out and str(timetable) in out
    stored = read_live(path)
    assert stored.run.steps == 100 == len(stored.timetable.due) and stored.run.dt == 1e-3 == stored.timetable.period
    assert stored.device == ("iapb.haptics.device:SimulatedDevice" if device else "")
    assert np.all(np.diff(stored.timetable.due) >= 1e-3 - 1e-9)
    assert content_hash(replay(stored)) == content_hash(stored.run)


@pytest.mark.parametrize("options", [("--seconds", "0"), ("--seconds", "nan"), ("--rate", "-3"), ("--rate", "0"),
                                     ("--device", "nothing"), ("--world", "heaven")], ids=str)
def test_what_cannot_be_done_is_named(live, options):
    status, _, err = live(*options)
    assert status == 1 and "expected" in err and "Traceback" not in err


DEVICES = """\
def broken(scene):
    raise RuntimeError("no cable")

class Mute:
    def read(self):
        raise RuntimeError("no answer")
    def apply(self, force):
        pass

def mute(scene):
    return Mute()
"""


@pytest.mark.parametrize(("factory", "said"), [("broken", "no cable"), ("mute", "no answer"), ("brokn", "broken?")])
def test_a_device_that_cannot_be_had_is_one_sentence(live, tmp_path, monkeypatch, factory, said):
    (tmp_path / "own_devices.py").write_text(DEVICES)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    status, _, err = live("--seconds", "0.1", "--device", f"own_devices:{factory}")
    assert status == 1 and err.startswith("iapb: ") and said in err and not list(tmp_path.glob("*.h5"))
