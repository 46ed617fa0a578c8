"""A fault in one case of a topic costs the topic that row only."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from iapb import find_scene
from reports.runner import Runner
from verification import check, engines
from verification.cost import (
    against_mujoco,
    growth,
    impacts,
    many_bodies,
    resting_scenes,
    start_up,
    step_cost,
    study,
    trajectories,
)
from verification.finding import Finding
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


def test_haptic_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes_at_rest = resting_scenes.resting_scenes()
    monkeypatch.setattr(against_mujoco, "_mujoco", lambda: None)
    monkeypatch.setattr(against_mujoco, "_race", broken(_races, lambda scene, *_: scene is scenes_at_rest[1]))
    for module in (against_mujoco, study):
        monkeypatch.setattr(module, "resting_scenes", lambda: scenes_at_rest)
    monkeypatch.setattr(study, "profile_step", broken(lambda *_, rounds: [], lambda scene: scene is scenes_at_rest[0]))
    monkeypatch.setattr(study, "SOLVER_CONTACTS", {"quick": (1, 2)})
    monkeypatch.setattr(step_cost, "_time_case", broken(_solver_rows, lambda case, *_: case.contacts == 2))
    clock = itertools.count(1)
    monkeypatch.setattr(growth, "_sampler", broken(lambda *_: lambda: 1e-6 * next(clock),
                                                   lambda method, d, c: (d, c) == (24, 60)))
    monkeypatch.setattr(growth, "_trial", broken(lambda *_: (0, 1e-6), lambda method, d, c, calls: (method, d, c) == (
        growth.PRINTED, 3, 60)))  # fmt: skip
    monkeypatch.setattr(many_bodies, "_cost", broken(_step_of, (50).__eq__))
    monkeypatch.setattr(study, "_robots", broken(lambda depth: None, lambda depth: True))
    monkeypatch.setattr(start_up, "_timed", broken(lambda *_: (1.0, 1.0), lambda *_: True))
    monkeypatch.setattr(impacts, "TRUNCATED", ((6, 24),))
    monkeypatch.setattr(impacts, "_stopped", broken(_stopped, lambda cases, budget: budget == 1))
    monkeypatch.setattr(trajectories, "Judge", broken(lambda scene: scene, lambda scene: "cradle" in scene.title))
    ways = {name: name for name in ("IAPB, midpoint", "PB, midpoint", "other")}
    monkeypatch.setattr(trajectories, "TRAJECTORY_SCENES", dict(list(trajectories.TRAJECTORY_SCENES.items())[:3]))
    monkeypatch.setattr(trajectories, "methods", lambda: ways)
    monkeypatch.setattr(trajectories, "over_steps", broken(_motions, lambda scene, way, *_: way == "other"))
    topic = study.haptic_study()
    assert lost(topic) == [
        f"race on {scenes_at_rest[1].name}", f"parts of a step, {scenes_at_rest[0].name}",
        "factored, d = 24, c = 60", "printed formula (numpy), d = 24, c = 60", "50 bodies", "robots", "iapb --help",
        "budget of 1 rows, d = 6, c = 24", "truth of cradle, e = 1", "other on bouncing ball, e = 0.7",
        "other on peg into a corner, e = 0", "60 contacts in 3 coordinates by the printed formula",
        "patch of 2 contacts", "pile of 2 contacts",
    ]  # fmt: skip


def _races(scene: Any, *_: Any) -> list[dict[str, Any]]:
    return [{"scene": scene.name, "MuJoCo's form": "box", "MuJoCo's solver": "Newton", "iapb's contacts": 4,
             "MuJoCo's contacts": 4, "MuJoCo's step": 100.0, "ratio": 0.01, "target": 0.1}]  # fmt: skip


def _step_of(n: int) -> dict[str, Any]:
    return {"bodies": n, "step": 1.0 * n, "contacts": 1.0, "pairs of shapes": n, "pairs tested": n}


def _solver_rows(case: Any, *_: Any) -> list[dict[str, Any]]:
    names = (step_cost.IAPB, step_cost.KERNEL, "daqp")
    return [{"impacts": case.family, "contacts": case.contacts, "solver": name, "outcome": "solved", "median": t,
             "least": t, "largest": t} for name, t in zip(names, (1.0, 0.1, 2.0), strict=True)]  # fmt: skip


def _stopped(cases: Any, budget: int) -> list[dict[str, Any]]:
    return [{"rank": 4, "budget": budget, "share of the loss": 0.5, "largest relative gain": -1.0}]


def _motions(*_: Any) -> list[dict[str, Any]]:
    return [{"position": 0.1, "energy made": 0.0, "time": 1.0, "outcome": "ok", "note": ""}]
