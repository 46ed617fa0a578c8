"""No kernel reads or writes beyond its arrays, and a count from a law in Python cannot make one do so."""

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

CASES = {"quick": "25", "deep": "300"}


def test_kernels_stay_within_their_arrays() -> None:
    count = CASES[os.environ.get("IAPB_HYPOTHESIS_PROFILE", "quick")]
    done = subprocess.run([sys.executable, "-m", "tests.robustness.bounds", count], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout.splitlines()[-1].split()[0]) >= int(count)


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
