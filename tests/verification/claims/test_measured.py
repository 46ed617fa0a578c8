"""Claims on losses, filters and times: what they measure is what they say, and a planted fault is noticed."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from reference.worlds import run_world
from verification.check import Study
from verification.claims import CLAIMS
from verification.claims.conditions import Condition
from verification.claims.socket import BOTH, Socket
from verification.claims.speed import SIZES, _fresh_impacts
from verification.cost import growth
from verification.cost.calls import PRINTED


def test_a_loss_that_depends_on_the_wall_is_noticed():
    """At the softer wall the last impact, which is not the first of its run, takes a millionth too much."""

    def run(scene, *which):
        made = run_world(scene, *which)
        if scene.contact.stiffness == 250.0:
            lost = made.impacts.energy_lost.copy()
            lost[-1] *= 1.0 + 1e-6
            made = replace(made, impacts=replace(made.impacts, energy_lost=lost))
        return made

    walls = Condition(0.1), Condition(0.1, stiffness=250.0), Condition(0.1, damping=0.0)
    table = CLAIMS["C17"].table(Study(run), walls)
    assert table.holds == (True, False, True) and min(table["impacts"]) > 1


def test_a_coherence_distance_above_speed_times_step_must_also_reach_the_next_facet():
    cases = [Socket(18, 1000.0, 20.0, 4.0, coherence) for coherence in (2.0, 3.0)]
    table = CLAIMS["C18"].table(Study(), cases)
    assert table.holds == (False, True) and set(table["part"]) == {BOTH}
    short, far = table["reach"]
    assert short < 1.0 < far


def test_a_range_of_sizes_is_confirmed_by_sizes_that_were_not_tried():
    fresh = [case.contacts for case in _fresh_impacts(Study(), SimpleNamespace(ends=lambda *_: (1, 200)))]
    assert fresh and not set(fresh) & set(SIZES)


@pytest.mark.parametrize(("milliseconds", "late"), [(0.9, (0, 0)), (1.5, (0, 5)), (2.5, (2, 2))])
def test_the_two_deadlines_are_those_of_512_hz_and_1_khz(monkeypatch, milliseconds, late):
    monkeypatch.setattr(growth, "_call", lambda *case: None)
    monkeypatch.setattr(growth, "seconds", lambda call: 1e-3 * milliseconds)
    rows = list(growth.haptic_rate(3, PRINTED, contacts=(6,), calls=5))
    assert {row["deadline"]: row["late calls [of 1000]"] for row in rows} == dict(
        zip((growth.PAPER_STEP, growth.MILLISECOND), late, strict=True))  # fmt: skip
