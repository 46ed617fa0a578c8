"""Kernels compiled for one scene alone give the bits of kernels compiled for all scenes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.iapb.contact.paper import scene_of

FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
BALL = {
    "name": "ball",
    "joint": "planar",
    "mass": 0.1,
    "inertia": 1e-5,
    "position": [0, 0.1, 0.0],
    "shapes": [{"kind": "circle", "radius": 0.02}],
}
BOX = BALL | {
    "name": "box",
    "position": [0.0, 0.3, 0.1],
    "shapes": [{"kind": "box", "size": [0.1, 0.05]}],
}
# Flags differ: a scene with room for one contact, and one with contacts of several bodies that rub.
SCENES = {
    "one contact": ([BALL], {"restitution": 0.5}),
    "several that rub": ([BALL, BOX], {"friction": 0.5}),
}
RUN = """
import sys; from iapb.scene import scene_from_text; from iapb import simulate
run = simulate(scene_from_text(sys.stdin.read())); print(len(run.impacts.step), run.q.tobytes().hex())
"""


@pytest.mark.thorough
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_runs_alike_on_its_own_kernels_and_on_those_of_all(name: str) -> None:
    bodies, contact = SCENES[name]
    text = scene_of(bodies, [FLOOR], gravity=[0, -9.81], duration=0.4, contact=contact).source_text
    found = [
        subprocess.run(
            [sys.executable, "-c", RUN],
            input=text,
            env=os.environ | {"IAPB_COMPILE": how},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for how in ("lean", "whole")
    ]
    assert len(set(found)) == 1 and int(found[0].split()[0]) > 0  # impacts
