"""An effect that is off is not entered: lines executed are counted, with the kernels run as plain Python.

A process of its own, because `NUMBA_DISABLE_JIT` is read once, when numba is imported.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

COUNTER = """
import json, linecache, sys
from collections import Counter
from pathlib import Path

import iapb
from iapb import Simulation, find_scene, load_scene
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.system import coupling_of

PACKAGE = str(Path(iapb.__file__).parent)
LAWS = {"penalty": Penalty, "impulses": ImpulseAugmented}


def lines_of_steps(scene, values, law, coupling, steps=6):
    scene = load_scene(find_scene(scene)).with_values(values)
    law = LAWS[law[0]](**law[1])
    simulation = Simulation(scene, law, coupling_of(scene, coupling))
    counted = Counter()

    def trace(frame, event, argument):
        if not frame.f_code.co_filename.startswith(PACKAGE):
            return None
        counted[f"def {frame.f_code.co_name}("] += event == "call"
        if event == "line":
            counted[linecache.getline(frame.f_code.co_filename, frame.f_lineno).strip()] += 1
        return trace

    sys.settrace(trace)
    for _ in range(steps):
        simulation.step()
    sys.settrace(None)
    on = {effect.name for effect in simulation.effects if effect.active}
    return {"counted": counted, "on": sorted(on)}


cases = json.load(sys.stdin)
print(json.dumps({name: lines_of_steps(*case) for name, case in cases.items()}))
"""

# One step from the floor, fast enough to reach it in the next one, and sliding.
NEAR = {"bodies.peg.position": [0.05, -0.0062, 0.0], "bodies.peg.velocity": [0.1, 0.5, 0.0], "contact.friction": 0.3}
FULL = {
    **NEAR, "gravity": [0.0, 1.0], "device.position_resolution": [1e-5, 1e-5, 1e-5], "device.damping": [1, 1, 1],
    "device.force_limit": [300, 300, 300], "contact.cluster_distance": 1e-4, "contact.coherence_distance": 1e-2,
}
IAPB, SPREAD, PENALTY = ("impulses", {}), ("impulses", {"rendering": "spread"}), ("penalty", {})
RUBBING = ("impulses", {"friction_in_impacts": True})


def peg(law=SPREAD, coupling="four-channel", **values):
    return ("peg_corner", {**FULL, **{name.replace("__", "."): value for name, value in values.items()}}, law, coupling)


ONE_LINK = {"bodies": [{"name": "upper", "joint": "revolute", "mass": 1, "center_of_mass": [0.25, 0]}]}
CASES = {
    "everything": peg(),
    "no gravity": peg(gravity=None),
    "no friction": peg(contact__friction=0),
    "no contact damping": peg(contact__damping=0),
    "no clustering": peg(contact__cluster_distance=0),
    "tilted": peg(law=PENALTY, contact__cluster_distance=0, bodies__peg__position=[0.05, -0.0072, 0.05]),
    "no filter": peg(contact__cluster_distance=0, contact__coherence_distance=0),
    "no walls": peg(walls=[]),
    "no impulses": peg(law=PENALTY),
    "limits ignored": peg(law=IAPB),
    "no device": peg(coupling="none"),
    "own restitution, alike": peg(law=IAPB, bodies__peg__restitution=0.5),
    "own restitution": ("bar_on_posts", {}, IAPB, "none"),
    "own restitution, no impulses": ("bar_on_posts", {}, PENALTY, "none"),
    "impact friction": peg(law=RUBBING),
    "impact friction, smooth": peg(law=RUBBING, contact__friction=0),
    "exact sensors": peg(device__position_resolution=None),
    "sensors of resolution 0": peg(device__position_resolution=[0, 0, 0]),
    "no device damping": peg(device__damping=None),
    "device damping 0": peg(device__damping=[0, 0, 0]),
    "hand holds still": peg(hand__force=[0, 0, 0]),
    "unilateral": peg(law=IAPB, coupling="unilateral"),
    "brake": peg(device__waveform="brake"),
    "brake, no impulses": peg(law=PENALTY, device__waveform="brake"),
    "brake, unilateral": peg(law=IAPB, coupling="unilateral", device__waveform="brake"),
    "pendulum": ("double_pendulum", {}, IAPB, "none"),
    "one link": ("double_pendulum", ONE_LINK, IAPB, "none"),
    "damped": ("double_pendulum", {"bodies.upper.joint_damping": 0.1}, IAPB, "none"),
    "limited": ("double_pendulum", {"bodies.upper.joint_limits": [-0.01, 4.0]}, IAPB, "none"),
    "arm with device": ("arm_pushing", {}, IAPB, "four-channel"),
}

# effect -> text of what only it executes
ONLY = {
    "gravity": ["def gravity("],
    "friction": ["def friction_share("],
    "contact_damping": ["force -= damping * normal_velocity"],
    "clustering": ["def cluster("],
    "coherence": ["def same_surface(", "def squared_distance("],
    "wall_contacts": ["def find_contacts(", "def detect(", "def contact_velocities(", "def resting_force("],
    "impulses": ["def resolve_collisions(", "def find_islands(", "def resolve_island(", "def factored_impact("],
    "unequal_restitution": ["def resolve_unequal(", "def poisson_impact(", "def pair_restitution("],
    "impact_friction": ["def add_friction_to_impact(", "def add_impact_friction("],
    "device_limits": ["def largest_share(", "force = min(max(force, -port.force_limit[i]), port.force_limit[i])"],
    "coupling": ["def measure(", "def coordinate(", "def command("],
    "quantisation": ["def sense("],
    "device_damping": ["a[i] -= port.device_damping[i] * port.device_v[i]"],
    "waveform": ["def shape_impulse(", "def observe_work("],
    "hand_force": ["def press("],
    "joint_damping": ["def damp_joints("],
    "joint_limits": ["def add_stops("],
    "varying_inertia": ["def mass_matrix(", "def cholesky_tree_blocks("],
    "velocity_terms": ["def bias("],
}


@pytest.fixture(scope="module")
def found():
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", COUNTER], input=json.dumps(CASES), env=environment, text=True,
                          capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("effect", ONLY)
def test_code_of_an_effect_runs_only_where_the_effect_is_on(effect, found):
    on = {case: effect in found[case]["on"] for case in CASES}
    for text in ONLY[effect]:
        ran = {case: found[case]["counted"].get(text, 0) > 0 for case in CASES}
        assert any(ran.values()) and not all(on.values()), text
        # a joint at its limit is a contact as well
        wrong = {case for case in CASES if ran[case] and not on[case]
                 and not (effect == "wall_contacts" and "joint_limits" in found[case]["on"])}
        assert not wrong, (text, wrong)


def test_the_unilateral_coupler_is_entered_by_its_own_world_only(found):
    assert found["unilateral"]["counted"]["def engage("] > 0
    assert "def engage(" not in found["everything"]["counted"]


def test_a_constant_mass_matrix_is_factored_before_the_first_step_and_never_again(found):
    for case in CASES:
        constant = "varying_inertia" not in found[case]["on"]
        counted = found[case]["counted"]
        factored = sum(number for line, number in counted.items() if line.startswith("def cholesky"))
        assert (counted.get("def mass_matrix(", 0) + factored == 0) == constant, case


def test_a_device_of_varying_inertia_costs_one_factor_more_and_not_more(found):
    tool = found["pendulum"]["counted"]["def mass_matrix("] / 6
    assert tool == 1  # one stage, one matrix
    assert found["arm with device"]["counted"]["def mass_matrix("] == 2 * 6
