"""A fault in one case of a topic costs the topic that row only."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from iapb import find_scene
from reports.runner import Runner
from verification import check, engines
from verification.cost import growth, trajectories
from verification.finding import Finding
from verification.haptic_rate import BENCH, RATE
from verification.scenes import ledger
from verification.stability import device_port, peg, walls
from verification.stability.topic import contact_stability


def broken(original: Callable[..., Any], here: Callable[..., bool]) -> Callable[..., Any]:
    """`original`, which raises where `here` is true of its arguments."""

    def call(*arguments: Any, **options: Any) -> Any:
        if here(*arguments):
            raise ZeroDivisionError("planted")
        return original(*arguments, **options)

    return call


def lost(topic: Finding) -> list[str]:
    """The cases that failed, each of the planted fault; the topic says how many."""
    assert {failure.error for failure in topic.failures} == {"ZeroDivisionError"}
    count = len(topic.failures)
    assert topic.answer.endswith(f"{count} case{'s' if count > 1 else ''} failed.")
    return [failure.case for failure in topic.failures]


def nothing(done: int, total: int) -> None:
    assert 0 <= done <= total


def test_stability(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(walls.GRIDS, "quick", (3, 5))
    monkeypatch.setattr(walls, "touch_walls", broken(walls.touch_walls, lambda loop, *_: loop.rate == 1000.0 and
                                                     not loop.delay and loop.device_damping == 5.0))
    monkeypatch.setattr(peg, "bounces", broken(peg.bounces, lambda trace: trace.dt == 1.0 / 512.0))
    monkeypatch.setitem(peg.STIFFNESSES, "quick", (500.0,))
    monkeypatch.setitem(peg.DAMPINGS, "quick", (50.0,))
    monkeypatch.setattr(peg, "DEVICES", {name: peg.DEVICES[name] for name in ("512 Hz", "1 kHz")})
    monkeypatch.setattr(peg, "WAVEFORM_RATE", 1000.0)
    monkeypatch.setitem(device_port.WALLS, "quick", (("CBuc", 1e3, 0.0), ("PB", 1e3, 0.0)))
    monkeypatch.setitem(device_port.SPEEDS, "quick", (0.3,))
    monkeypatch.setattr(device_port, "actuator_forces", broken(device_port.actuator_forces, lambda loop, x: (
        loop.world == "PB" and loop.delay == 1 and not loop.resolution)))
    topic = contact_stability(Runner(tmp_path), "quick", nothing)
    loop = "1000 Hz, delay 0, device damping 5 N s/m"
    assert lost(topic) == [
        f"maps, {loop}", f"hardness, {loop}", "peg, 512 Hz, 500.0, 50.0",
        "hand port, PB, 1000.0, 0.0, late, presses", "hand port, PB, 1000.0, 0.0, late, crosses",
    ]
    assert len(topic.parts) == 9
    assert len(topic.tables["maps"].rows) == 3 * 7 and len(topic.tables["peg"].rows) == 2
    assert len(topic.tables["hand port"].rows) == 2 * len(device_port.SENSORS) * 2 - 2


def test_engines(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(engines, "SIMULATORS", ("iapb", "rigid"))
    monkeypatch.setattr(engines, "FIXED_SCENES", ("redundant_wedge", "bernoulli"))
    monkeypatch.setattr(engines, "_both", broken(engines._both, lambda name, scene, depth: (
        name, scene) == ("rigid", "bernoulli")))
    topic = engines.engines(Runner(tmp_path), "quick", nothing)
    assert lost(topic) == ["errors, rigid, bernoulli"]
    assert topic.tables["errors"].column("scene") == ["redundant wedge"] * 2 + ["bernoulli"] * 2 + [
        "redundant wedge"] * 2


def test_scenes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    name, names = "tumbling_body", ("peg_corner", "two_discs", "tumbling_body")
    monkeypatch.setattr(ledger, "scene_names", lambda: names)
    monkeypatch.setattr(check, "find_scene", broken(find_scene, name.__eq__))
    topic = ledger.scene_ledger(Runner(tmp_path), "quick", nothing)
    assert lost(topic) == [f"{one.key}, {name}" for one in ledger.scene_ledger.checks]
    assert topic.tables["energy ledger"].column("scene") == [each for each in names if each != name]
    assert len(topic.parts) == 7


def test_haptic_rate(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    clock = itertools.count(1)
    monkeypatch.setattr(growth, "size_sampler", broken(lambda *_: lambda: 1e-6 * next(clock),
                                                       lambda method, d, c: (d, c) == (24, 60)))
    monkeypatch.setattr(growth, "late_calls", broken(
        lambda *_: (0, 1e-6), lambda method, d, c, calls: (method, d, c) == (growth.PRINTED, 3, 60)))
    monkeypatch.setattr(trajectories, "Judge", broken(lambda scene: scene, lambda scene: "cradle" in scene.title))
    ways = {name: name for name in ("IAPB, midpoint", "PB, midpoint", "other")}
    monkeypatch.setattr(trajectories, "methods", lambda: ways)
    monkeypatch.setattr(trajectories, "over_steps", broken(_motions, lambda scene, way, *_: way == "other"))
    motions = replace(trajectories.MOTIONS, cases=lambda _: list(trajectories.TRAJECTORY_SCENES)[:3])
    checks = (growth.SCALING, growth.FITTED, RATE, motions, trajectories.WORTH)
    topic = replace(BENCH, checks=checks)(Runner(tmp_path), "quick", nothing)
    assert lost(topic) == [
        "scaling, factored, d = 24, c = 60", "scaling, printed formula (numpy), d = 24, c = 60",
        "contacts at 1 kHz, 60 contacts in 3 coordinates by the printed formula", "motions, cradle",
        "motions, other on bouncing ball, e = 0.7", "motions, other on peg into a corner, e = 0",
    ]  # fmt: skip


def _motions(*_: Any) -> list[dict[str, Any]]:
    return [{"step [ms]": 1.0, "position": 0.1, "energy made": 0.0, "time [ms/s]": 1.0, "outcome": "ok", "note": ""}]
