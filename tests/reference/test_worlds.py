"""The paper's worlds by name: laws, couplings, and that half a run is no evidence. BLAS has one thread inside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from iapb.contact.laws import ImpulseAugmented
from iapb.errors import ArgumentError, IapbError
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import INTERRUPTED, simulate
from reference.one_thread import one_thread
from reference.worlds import WORLDS, find_world, require_complete, run_world

PEG = load_scene(find_scene("peg_corner"))


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_is_a_law_and_a_coupling_with_the_scenes_gains(name: str) -> None:
    world = find_world(name)
    coupling = world.coupling_in(PEG)
    assert coupling.name == ("unilateral" if name == "CBuc" else "four-channel")
    gains = getattr(PEG.couplings, coupling.name.replace("-", "_"))
    assert coupling.settings == {"stiffness": list(gains.stiffness), "damping": list(gains.damping)}
    run, parts = run_world(PEG, name, steps=60), simulate(PEG, world.law, coupling, steps=60)
    assert run.world == name and run.complete
    assert np.array_equal(run.q, parts.q) and np.array_equal(run.device_q, parts.device_q)
    assert world.coupling_in(load_scene(find_scene("two_discs"))).name == "none"
    assert world.coupling_in(PEG.with_values({"couplings": {}})).name == "none"


def test_a_box_on_a_slope_slides_in_the_world_without_friction_and_sticks_in_the_one_with_it() -> None:
    sin, cos, box = np.sin(np.pi / 9.0), np.cos(np.pi / 9.0), {"kind": "box", "size": [0.1, 0.1]}
    slope = Scene.model_validate({
        "name": "slope", "rate": 500.0, "duration": 0.2, "gravity": [0.0, -9.81], "contact": {"friction": 0.5},
        "bodies": [{"name": "box", "joint": "planar", "mass": 1.0, "inertia": 1.0 / 600.0, "shapes": [box],
                    "position": [0.05 * sin, 0.05 * cos, -np.pi / 9.0]}],
        "walls": [{"name": "slope", "kind": "half_plane", "point": [0.0, 0.0], "normal": [sin, cos]}],
    })  # fmt: skip
    ice = slope.with_values({"bodies.box.friction": 0.0})
    assert run_world(ice, "ideal-friction").q[-1, :2] == pytest.approx(run_world(ice, "ideal").q[-1, :2], abs=1e-12)
    slid = {name: float(np.diff(run_world(slope, name).q[[0, -1], :2], axis=0)[0] @ [cos, -sin])
            for name in ("ideal", "ideal-friction")}  # fmt: skip
    # The step is a hundredth of 0.2 s, and the law is of first order.
    assert slid["ideal"] == pytest.approx(0.5 * 9.81 * sin * 0.2**2, rel=0.02)
    assert abs(slid["ideal-friction"]) < 1e-9


def test_a_scene_may_be_given_by_name_or_path_and_a_rendering_goes_into_the_label() -> None:
    for scene in ("peg_corner", find_scene("peg_corner"), str(find_scene("peg_corner"))):
        assert np.array_equal(run_world(scene, "PB", steps=3).q, run_world(PEG, "PB", steps=3).q)
    assert find_world("IAPB", "spread").law == ImpulseAugmented(rendering="spread")
    assert run_world(PEG, "IAPB", "scale", steps=3).world == "IAPB scale"


@pytest.mark.parametrize(("call", "says"), [
    (lambda: run_world("peg_cornre", "PB"), "peg_corner"),
    (lambda: find_world("CBuc").coupling_in(PEG.with_values({"couplings.unilateral": None})), "gives no gains"),
    (lambda: find_world("ideal", "spread"), "rendering = 'spread': expected full.*ideal"),
    (lambda: find_world("PB", "spread"), "rendering = 'spread': expected full.*PB"),
    (lambda: find_world("IAPB", "clip"), "rendering = 'clip'"),
    (lambda: find_world("best"), "world = 'best': expected one of IAPB, PB, "),
])  # fmt: skip
def test_refusals(call: Callable[[], Any], says: str) -> None:
    with pytest.raises(ArgumentError, match=says):
        call()


def interrupt(done: int, total: int) -> None:
    raise KeyboardInterrupt


def test_an_incomplete_run_is_handed_on_only_to_who_asks_for_it() -> None:
    with pytest.raises(KeyboardInterrupt):
        run_world(PEG, "PB", progress=interrupt)
    run = run_world(PEG, "PB", progress=interrupt, partial=True)
    assert not run.complete and run.stopped == INTERRUPTED and 0 < run.steps < PEG.steps
    with pytest.raises(IapbError, match="peg_corner in the world PB stopped after .* s: too fast"):
        require_complete(replace(run, stopped="too fast"))
    whole = replace(run, complete=True, stopped="")
    assert require_complete(whole) is whole


def test_every_blas_has_one_thread_inside_and_its_own_number_outside() -> None:
    def threads() -> list[int]:
        return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]

    with one_thread():
        pass  # now numpy's and scipy's are loaded
    before = threads()
    with one_thread():
        assert len(before) >= 2 and threads() == [1] * len(before)
    assert threads() == before
