"""Claims on losses, filters and times: what they measure is what they say, and a planted fault is
noticed."""

from dataclasses import replace

import numpy as np
import pytest

from reference.worlds import run_world
from verification.check import Study
from verification.claims import CLAIMS
from verification.claims.conditions import Condition
from verification.claims.peg import (
    AVERAGED,
    INCREASES,
    RESOLVED,
    RESOLVED_FORCE,
    WORLDS,
    place,
    trace,
)
from verification.claims.socket import BOTH, REACH, Socket
from verification.cost import growth
from verification.cost.calls import PRINTED
from verification.scenes import measures


def test_a_loss_that_depends_on_the_wall_is_noticed():
    """At the softer wall the last impact, which is not the first of its run, takes a millionth too
    much."""

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


def test_a_scaled_impulse_that_is_not_an_impact_with_another_e_is_noticed():
    """If each impulse is recorded as 1 % smaller than it is, no energy is gained, but Newton's law
    fails."""
    for share, held in ((1.0, True), (0.99, False)):

        def run(*which, share=share):
            made = run_world(*which)
            return replace(made, impacts=replace(made.impacts, scale=share * made.impacts.scale))

        assert CLAIMS["C08"].table(Study(run), [("spread", Condition(0.1))]).holds == (True, held)


def test_settling_with_saturated_impulses_is_compared_with_full_ones():
    runs = (
        run_world,
        lambda scene, world, rendering: run_world(
            scene, world, rendering.replace("saturate", "full")
        ),
    )
    rows = [
        CLAIMS["C12"].table(Study(run), [Condition(0.1)]).where(part=INCREASES).records()[0]
        for run in runs
    ]
    assert rows[0]["ahead"] * (rows[0]["saturate"] - rows[0]["full"]) > 0.0 == rows[1]["ahead"]


def test_a_coherence_distance_above_speed_times_step_must_also_reach_the_next_facet():
    cases = [Socket(18, 1000.0, 20.0, 4.0, coherence) for coherence in (2.0, 3.0)]
    table = CLAIMS["C18"].table(Study(), cases)
    assert table.holds == (False, True) and set(table["part"]) == {BOTH}
    short, far = table[REACH]
    assert short < 1.0 < far


STARTS = (
    Condition(),
    Condition(0.03, travel=0.02),
    Condition(0.1, travel=0.02),
    Condition(0.1, 0.003),
    Condition(0.1, 0.02),
    Condition(0.35, 0.02),
)


@pytest.mark.thorough
def test_the_bands_bound_what_a_shorter_step_of_the_ideal_world_changes():
    """The bands are 1 to 3.5 times what the lead of IAPB changes by if the ideal world has four
    times the rate."""
    study = Study()
    changes = []
    for start in STARTS:
        ideal, *worlds = (trace(study, start, world) for world in ("ideal", *WORLDS))
        fine = measures.trace_of(
            run_world(place(study, start).with_values({"rate": 4.0 / ideal.dt}), "ideal")
        )
        fine = replace(
            fine,
            device=fine.device[::4],
            device_force=fine.device_force.reshape(-1, 4, 3).mean(axis=1),
        )
        window = measures.comparison_window([ideal, *worlds])
        far = np.array(
            [
                [
                    [
                        *measures.root_mean_square(one, rigid, window),
                        *measures.force_distance(one, rigid, window, AVERAGED),
                    ]
                    for one in worlds
                ]
                for rigid in (ideal, fine)
            ]
        )
        changes.append(np.abs(np.diff(far[:, 1:].min(axis=1) - far[:, 0], axis=0)))
    bands = [band[name] for band in (RESOLVED, RESOLVED_FORCE) for name in measures.COORDINATES]
    times = bands / np.max(changes, axis=0)
    assert np.all((times >= 1.0) & (times < 3.5)), times


@pytest.mark.parametrize(("milliseconds", "late"), [(0.9, (0, 0)), (1.5, (0, 5)), (2.5, (2, 2))])
def test_the_two_deadlines_are_those_of_512_hz_and_1_khz(monkeypatch, milliseconds, late):
    monkeypatch.setattr(growth, "printed_call", lambda case: None)
    monkeypatch.setattr(growth, "sampler", lambda call: lambda: 1e-3 * milliseconds)
    monkeypatch.setattr(growth, "seconds", lambda call: 1e-3 * milliseconds)
    rows = list(growth.haptic_rate(3, PRINTED, contacts=(6,), calls=5))
    assert {row["deadline"]: row["late calls [of 1000]"] for row in rows} == dict(
        zip((growth.PAPER_STEP, growth.MILLISECOND), late, strict=True)
    )
