"""The paper's worlds by name: laws, couplings, and that half a run is no evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb.advice.effects import ignored_fields
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, IapbError
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import INTERRUPTED, simulate
from reference.worlds import WORLDS, find_world, require_complete, run_world

PEG = load_scene(find_scene("peg_corner"))
STEPS = 60

COUPLINGS = {"ideal": "four-channel", "IAPB": "four-channel", "PB": "four-channel", "CBuc": "unilateral",
             "ideal-friction": "four-channel", "IAPB-friction": "four-channel", "IAPB-push": "four-channel"}
LAWS = {"ideal": "rigid constraints", "IAPB": "impulse-augmented penalty", "PB": "penalty", "CBuc": "rigid constraints",
        "ideal-friction": "rigid constraints",
        "IAPB-friction": "impulse-augmented penalty with impact friction",
        "IAPB-push": "impulse-augmented penalty, contacts only push"}


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_is_a_law_and_a_coupling_with_the_scenes_gains(name):
    world = find_world(name)
    coupling = world.coupling_in(PEG)
    assert (world.law.name, coupling.name) == (LAWS[name], COUPLINGS[name])
    gains = getattr(PEG.couplings, coupling.name.replace("-", "_"))
    assert coupling.settings == {"stiffness": list(gains.stiffness), "damping": list(gains.damping)}


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_runs_as_its_parts_do(name):
    world = find_world(name)
    run = run_world(PEG, name, steps=STEPS)
    parts = simulate(PEG, world.law, world.coupling_in(PEG), steps=STEPS)
    assert run.world == name and run.complete
    assert np.array_equal(run.q, parts.q) and np.array_equal(run.device_q, parts.device_q)


def test_contacts_of_the_pushing_world_never_pull_and_those_of_iapb_do():
    least = {name: run_world(PEG, name).contacts.impulse.min() for name in ("IAPB", "IAPB-push")}
    assert least["IAPB"] < -1e-6 and least["IAPB-push"] >= 0.0
    assert run_world(PEG, "IAPB-push").impacts.energy_lost.min() >= 0.0


SLOPE = Scene.model_validate({
    "name": "slope", "rate": 500.0, "duration": 0.2, "gravity": [0.0, -9.81],
    "bodies": [{"name": "box", "joint": "planar", "mass": 1.0, "inertia": 1.0 / 600.0,
                "shapes": [{"kind": "box", "size": [0.1, 0.1]}],
                "position": [0.05 * np.sin(np.pi / 9.0), 0.05 * np.cos(np.pi / 9.0), -np.pi / 9.0]}],
    "walls": [{"name": "slope", "kind": "half_plane", "point": [0.0, 0.0],
               "normal": [np.sin(np.pi / 9.0), np.cos(np.pi / 9.0)]}],
    "contact": {"friction": 0.5},
})  # fmt: skip


def test_a_box_on_a_slope_slides_in_the_world_without_friction_and_sticks_in_the_one_with_it():
    down = np.array([np.cos(np.pi / 9.0), -np.sin(np.pi / 9.0)])
    slid = {name: float(np.diff(run_world(SLOPE, name).q[[0, -1], :2], axis=0)[0] @ down)
            for name in ("ideal", "ideal-friction")}  # fmt: skip
    # The step is a hundredth of 0.2 s, and the law is of first order.
    assert slid["ideal"] == pytest.approx(0.5 * 9.81 * np.sin(np.pi / 9.0) * 0.2**2, rel=0.02)
    assert abs(slid["ideal-friction"]) < 1e-9


@pytest.mark.parametrize(
    ("name", "ignored"),
    [("ideal", ("friction", "stiffness", "damping")), ("ideal-friction", ("stiffness", "damping")),
     ("PB", ("restitution",)), ("IAPB", ()), ("IAPB-friction", ())],
)  # fmt: skip
def test_a_run_says_which_fields_of_the_scene_its_law_ignores(name, ignored):
    assert ignored_fields(run_world(SLOPE, name, steps=1).effects) == ignored


def test_what_a_scene_does_not_give_is_not_said_to_be_ignored():
    bare = SLOPE.with_values({"contact.friction": 0.0, "contact.damping": 0.0})
    assert ignored_fields(run_world(bare, "ideal", steps=1).effects) == ("stiffness",)
    alone = load_scene(find_scene("double_pendulum"))
    assert ignored_fields(run_world(alone, "ideal", steps=1).effects) == ()


def test_a_scene_may_be_given_by_name_or_path():
    for scene in ("peg_corner", find_scene("peg_corner"), str(find_scene("peg_corner"))):
        assert np.array_equal(run_world(scene, "PB", steps=3).q, run_world(PEG, "PB", steps=3).q)
    with pytest.raises(ArgumentError, match="peg_corner"):
        run_world("peg_cornre", "PB")


def test_without_hand_or_gains_there_is_no_coupling():
    for name in WORLDS:
        assert find_world(name).coupling_in(load_scene(find_scene("two_discs"))).name == "none"
        assert find_world(name).coupling_in(PEG.with_values({"couplings": {}})).name == "none"


def test_gains_for_the_other_coupling_alone_are_not_taken_instead():
    with pytest.raises(ArgumentError, match="gives no gains"):
        find_world("CBuc").coupling_in(PEG.with_values({"couplings.unilateral": None}))


def test_a_rendering_belongs_to_iapb_and_goes_into_the_label():
    assert find_world("IAPB", "spread").law == ImpulseAugmented(rendering="spread")
    assert find_world("PB").law == Penalty()
    assert run_world(PEG, "IAPB", "scale", steps=3).world == "IAPB scale"
    for name in ("ideal", "PB", "CBuc"):
        with pytest.raises(ArgumentError, match=f"rendering = 'spread': expected full.*{name}"):
            find_world(name, "spread")
    with pytest.raises(ArgumentError, match="rendering = 'clip'"):
        find_world("IAPB", "clip")
    with pytest.raises(ArgumentError, match="world = 'best': expected one of IAPB, PB, "):
        find_world("best")


def interrupt(done, total):
    raise KeyboardInterrupt


def test_an_incomplete_run_is_handed_on_only_to_who_asks_for_it():
    with pytest.raises(KeyboardInterrupt):
        run_world(PEG, "PB", progress=interrupt)
    run = run_world(PEG, "PB", progress=interrupt, partial=True)
    assert not run.complete and run.stopped == INTERRUPTED and 0 < run.steps < PEG.steps
    with pytest.raises(IapbError, match="peg_corner in the world PB stopped after .* s: too fast"):
        require_complete(replace(run, stopped="too fast"))
    whole = replace(run, complete=True, stopped="")
    assert require_complete(whole) is whole


@pytest.mark.parametrize("world", ["ideal", "ideal-friction"])
def test_a_box_in_a_gap_too_narrow_for_it_is_not_trusted_in_the_rigid_worlds(world: str) -> None:
    walls = [{"name": name, "kind": "box", "size": [0.5, 1.0], "center": [x, 0.0]} for name, x in
             (("left", -0.28), ("right", 0.28))]
    body = {"name": "box", "joint": "planar", "mass": 1.0, "inertia": 0.0017, "position": [0.0, 0.0, 0.0],
            "shapes": [{"kind": "box", "size": [0.1, 0.1]}]}
    scene = Scene.model_validate({"name": "gap", "rate": 1000.0, "duration": 0.3, "gravity": [0, -9.81],
                                  "bodies": [body], "walls": walls, "contact": {"friction": 0.3}})
    run = run_world(scene, world)
    assert any("in a gap that is 40 mm narrower than it" in why for why in run.distrust)
