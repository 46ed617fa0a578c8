"""No kernel reads or writes beyond its arrays, or reads what was never written; a law's count cannot make one do so."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import pytest

from iapb import ArgumentError
from iapb.contact.laws import Penalty, StepResult
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate

PROFILE = os.environ.get("IAPB_HYPOTHESIS_PROFILE", "quick")


def test_kernels_stay_within_their_arrays() -> None:
    count = {"quick": "25", "deep": "300"}[PROFILE]
    done = subprocess.run([sys.executable, "-m", "tests.robustness.bounds", count], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout.splitlines()[-1].split()[0]) >= int(count)


def test_runs_do_not_depend_on_what_was_in_memory_before() -> None:
    """Each scene twice in a process, and in two whose fresh memory holds other bytes."""
    count = {"quick": "25", "deep": "1000"}[PROFILE]
    one, other = (subprocess.run([sys.executable, "-m", "tests.robustness.bounds", count, "twice"], text=True,
                                 capture_output=True, check=True, env=os.environ | {"MALLOC_PERTURB_": byte}).stdout
                  for byte in ("1", "165"))
    hashes = [line.split()[-2:] for line in one.splitlines()[:-1]]
    assert one == other and len(hashes) >= int(count) and all(first == second for first, second in hashes)


@dataclass(frozen=True)
class Overcounting:
    """A law whose step is the engine's, and which then claims that many contacts or impacts."""

    contacts: int = 0
    impacts: int = 0
    name = "overcounting"

    @property
    def settings(self) -> dict[str, Any]:
        return {}

    def advance(self, system: Any, state: Any, applied_force: Any, dt: float) -> StepResult:
        made = Penalty().advance(system, state, applied_force, dt)
        state.contact_count[0], state.impacts.logged[0] = self.contacts, self.impacts
        return made


@pytest.mark.parametrize("law", [Overcounting(contacts=200), Overcounting(contacts=-1), Overcounting(impacts=10**6)])
def test_a_count_beyond_its_buffer_is_named(law: Overcounting) -> None:
    with pytest.raises(ArgumentError, match="the law 'overcounting' returned"):
        simulate(load_scene(find_scene("peg_corner")), law, steps=3)
