"""An effect that is off is not entered: calls are counted, with the kernels run as plain Python.

A process of its own, because `NUMBA_DISABLE_JIT` is read once, when iapb is imported.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

COUNTER = """
import json, sys
from collections import Counter
from pathlib import Path

import iapb
from iapb import Simulation, find_scene, load_scene
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.system import coupling_of

PACKAGE = str(Path(iapb.__file__).parent)
LAWS = {"penalty": Penalty, "impulses": ImpulseAugmented}


def calls_of_steps(scene, values, law, coupling, steps=6):
    scene = load_scene(find_scene(scene)).with_values(values)
    law = LAWS[law[0]](**law[1])
    simulation = Simulation(scene, law, coupling_of(scene, coupling))
    counted = Counter()

    def count(frame, event, argument):
        if event == "call" and frame.f_code.co_filename.startswith(PACKAGE):
            counted[frame.f_code.co_name] += 1

    sys.setprofile(count)
    for _ in range(steps):
        simulation.step()
    sys.setprofile(None)
    on = {effect.name for effect in simulation.effects if effect.active}
    return {"counted": counted, "on": sorted(on)}


cases = json.load(sys.stdin)
print(json.dumps({name: calls_of_steps(*case) for name, case in cases.items()}))
"""

# One step from the floor, fast enough to reach it in the next one, and sliding.
NEAR = {
    "bodies.peg.position": [0.05, -0.0062, 0.0],
    "bodies.peg.velocity": [0.1, 0.5, 0.0],
    "contact.friction": 0.3,
}
FULL = {
    **NEAR,
    "gravity": [0.0, 1.0],
    "device.position_resolution": [1e-5, 1e-5, 1e-5],
    "device.damping": [1, 1, 1],
    "device.force_limit": [300, 300, 300],
    "contact.cluster_distance": 1e-4,
    "contact.coherence_distance": 1e-2,
}
IAPB = ("impulses", {})
SPREAD = ("impulses", {"rendering": "spread"})
PENALTY = ("penalty", {})
RUBBING = ("impulses", {"friction_in_impacts": True})


def peg(law=SPREAD, coupling="four-channel", **values):
    return (
        "peg_corner",
        {**FULL, **{name.replace("__", "."): value for name, value in values.items()}},
        law,
        coupling,
    )


ONE_LINK = {
    "bodies": [{"name": "upper", "joint": "revolute", "mass": 1, "center_of_mass": [0.25, 0]}]
}
CASES = {
    "everything": peg(),
    "no gravity": peg(gravity=None),
    "no friction": peg(contact__friction=0),
    "tilted": peg(
        law=PENALTY, contact__cluster_distance=0, bodies__peg__position=[0.05, -0.0072, 0.05]
    ),
    "no filter": peg(contact__cluster_distance=0, contact__coherence_distance=0),
    "no walls": peg(walls=[]),
    "no impulses": peg(law=PENALTY),
    "no device": peg(coupling="none"),
    "own restitution": ("bar_on_posts", {}, IAPB, "none"),
    "impact friction": peg(law=RUBBING),
    "hand holds still": peg(hand__force=[0, 0, 0]),
    "pendulum": ("double_pendulum", {}, IAPB, "none"),
    "one link": ("double_pendulum", ONE_LINK, IAPB, "none"),
    "damped": ("double_pendulum", {"bodies.upper.joint_damping": 0.1}, IAPB, "none"),
    "dry": ("double_pendulum", {"bodies.upper.joint_friction": 0.1}, IAPB, "none"),
    "limited": ("double_pendulum", {"bodies.upper.joint_limits": [-0.01, 4.0]}, IAPB, "none"),
    "implicit": peg(law=IAPB, contact__forces="implicit"),
}

# effect -> kernels that it alone enters
ONLY = {
    "gravity": "gravity",
    "friction": "friction_share",
    "implicit_contact": "rest_implicitly",
    "supports": "leave_out_seams",
    "touch": "let_go cut_at_touch contacts_at_end find_fast_pairs",
    "clustering": "cluster",
    "coherence": "same_surface squared_distance",
    "wall_contacts": "find_contacts detect contact_velocities resting_force",
    "impulses": "resolve_collisions find_islands resolve_island factored_impact",
    "unequal_restitution": "resolve_unequal poisson_impact pair_restitution",
    "impact_friction": "add_friction_to_impact add_impact_friction",
    "device_limits": "largest_share",
    "coupling": "measure coordinate command",
    "quantisation": "sense",
    "hand_force": "press",
    "joint_damping": "damp_joints",
    "joint_friction": "is_dry",
    "joint_limits": "add_stops",
    "varying_inertia": "mass_matrix cholesky_tree_blocks",
    "velocity_terms": "bias",
}


@pytest.fixture(scope="module")
def found():
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", COUNTER],
        input=json.dumps(CASES),
        env=environment,
        text=True,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("effect", ONLY)
def test_code_of_an_effect_runs_only_where_the_effect_is_on(effect, found):
    on = {case for case in CASES if effect in found[case]["on"]}
    if effect == "wall_contacts":  # a joint at its limit is a contact as well
        on |= {case for case in CASES if "joint_limits" in found[case]["on"]}
    if effect == "implicit_contact":  # friction of joints is solved with contacts
        on |= {case for case in CASES if "joint_friction" in found[case]["on"]}
    if effect == "unequal_restitution":  # contacts that carry a load only push, too
        on |= {case for case in CASES if "supports" in found[case]["on"]}
    for name in ONLY[effect].split():
        ran = {case for case in CASES if name in found[case]["counted"]}
        assert ran and ran <= on < CASES.keys(), name
