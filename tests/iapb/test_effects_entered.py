"""An effect that is off is not entered: calls are counted, with the kernels run as plain Python.

A process of its own, because `NUMBA_DISABLE_JIT` is read once, when iapb is imported.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.given import data_of

COUNTER = """
import json, sys
from collections import Counter
from pathlib import Path

import iapb
from iapb import Simulation, find_scene, load_scene
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.system import coupling_of

PACKAGE = str(Path(iapb.__file__).parent)


def calls_of_steps(case, steps=6):
    scene = load_scene(find_scene(case["scene"])).with_values(case["set"])
    law = Penalty() if case["law"] is None else ImpulseAugmented(**case["law"])
    simulation = Simulation(scene, law, coupling_of(scene, case["coupling"]))
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
print(json.dumps({name: calls_of_steps(case) for name, case in cases.items()}))
"""

GIVEN = data_of(__file__, "entered.yaml")
CASES = GIVEN["cases"]


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


@pytest.mark.parametrize("effect", GIVEN["only"])
def test_code_of_an_effect_runs_only_where_the_effect_is_on(effect, found):
    enters = {effect, GIVEN["also"].get(effect)}
    on = {case for case in CASES if enters & set(found[case]["on"])}
    for name in GIVEN["only"][effect]:
        ran = {case for case in CASES if name in found[case]["counted"]}
        assert ran and ran <= on < CASES.keys(), name
