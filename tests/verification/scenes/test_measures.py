"""Measures of trajectories, on traces written by hand whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest

from iapb import find_scene, load_scene
from verification.claims.conditions import Condition
from verification.scenes import measures

STEPS = 100
DT = 0.01
AT = np.arange(STEPS + 1)  # instants, in steps


def trace(device=None, velocity=None, force=None, contact_at=10, tool=None):
    states = np.zeros((STEPS + 1, 3))
    steps = np.zeros((STEPS, 3))
    new = np.zeros(STEPS, bool)
    new[contact_at] = True
    device = states if device is None else device
    return measures.Trace(
        AT * DT,
        device,
        device if tool is None else tool,
        states if velocity is None else velocity,
        steps if force is None else force,
        steps + [-0.32, 0.4, 0.0],
        np.zeros(STEPS),
        new,
        np.array([contact_at]),
        np.array([1e-3]),
        np.array([1.0]),
        np.zeros(1),
        np.zeros(STEPS + 1),
    )


def column(values, index):
    out = np.zeros((len(values), 3))
    out[:, index] = values
    return out


UNTIL_50 = column(AT <= 50, 0)
FOREVER = column(np.full(STEPS + 1, 0.1), 2)


def test_distances_are_taken_in_the_window():
    late = np.where(AT >= 20, 2e-3, 0.0)
    ours = trace(device=column(late, 1))
    ideal = trace()
    assert measures.root_mean_square(ours, ideal, slice(20, 60)) == pytest.approx([0.0, 2e-3, 0.0])
    assert measures.root_mean_square(ours, ideal, slice(0, 40)) == pytest.approx(
        [0.0, 2e-3 / np.sqrt(2), 0.0]
    )


def test_window_goes_from_the_first_contact_to_the_last_settling():
    window = measures.comparison_window(
        [trace(contact_at=12), trace(velocity=UNTIL_50, contact_at=15)]
    )
    assert (window.start, window.stop) == (12, 52)
    assert measures.comparison_window([trace(), trace(velocity=FOREVER)]).stop == STEPS + 1


def test_settling_counts_from_the_first_contact():
    assert measures.settling_time(trace(velocity=UNTIL_50, contact_at=10)) == pytest.approx(0.41)
    assert measures.settling_time(trace(velocity=FOREVER)) is None
    slowing = trace(velocity=column(1e-3 * 2.0 ** (2.5 - AT / 20), 0), contact_at=10)
    assert measures.settling_times(slowing) == pytest.approx(
        [0.6, 0.4, 0.2]
    )  # below 0.5, 1 and 2 mm/s
    assert measures.settling_times(trace(velocity=FOREVER)) == pytest.approx([0.9] * 3)


def test_a_spike_one_step_later_hardly_counts_and_a_missing_one_counts_in_full():
    early, late = (trace(force=column(np.eye(1, STEPS, step)[0] * 60.0, 0)) for step in (30, 31))
    far, none, shifted = (
        measures.force_distance(late, other, slice(20, STEPS), steps)[0]
        for other, steps in ((early, 1), (trace(), 16), (early, 16))
    )
    assert (far, none, shifted) == pytest.approx((2 * 60.0 / 80, 60.0 / 80, 2 * 60.0 / 16 / 80))
    assert measures.peak_force(late)[0] == 60.0


def test_balance_is_judged_in_contact_and_outside_collisions():
    """x touches the right wall from step 20 on, y never; step 30 collides, step 60 is out of
    balance by 5 N."""
    x = np.where(AT < 20, 0.05, 0.0105)
    force = np.tile([0.32, 9.0, 0.0], (STEPS, 1)) + column(80.0 * np.eye(1, STEPS, 30)[0], 0)
    force += column(5.0 * np.eye(1, STEPS, 60)[0], 0) + column(7.0 * np.eye(1, STEPS, 5)[0], 0)
    states = np.column_stack([x, np.full((STEPS + 1, 2), (-0.05, 0.0))])
    pushed = replace(trace(device=states, force=force), impact_step=np.array([30]))
    assert measures.unbalanced_force(pushed, slice(0, STEPS + 1)) == pytest.approx(
        [5.0 / 79, 0.0, 0.0]
    )
    assert measures.unbalanced_force(pushed, slice(0, 20)) == pytest.approx([0.0, 0.0, 0.0])


def test_impacts_separate_in_their_own_step_only():
    apart = column(np.where(AT > 40, 3e-4, 0.0), 0)  # in step 40
    parted = trace(tool=apart, device=np.zeros_like(apart))
    assert measures.separation_by_impacts(parted).max() == 0.0
    assert measures.separation_by_impacts(replace(parted, impact_step=np.array([10, 40])))[
        0
    ] == pytest.approx(3e-4)


def test_the_overlap_of_the_device_is_that_of_its_deepest_corner():
    # 0.5 mm in the right wall
    away, inside = (np.tile([x, -0.05, 0.0], (STEPS + 1, 1)) for x in (0.05, 0.0100))
    assert measures.device_overlap(trace(device=inside, tool=away)) == pytest.approx(5e-4)
    assert measures.device_overlap(trace(device=away)) == 0.0


@pytest.mark.parametrize(
    ("heights", "count"),
    [
        (
            1e-3 * ((AT >= 30) & (AT < 40)),
            2,
        ),  # both corners, once
        *((height * (AT % 2), 0) for height in (0.0, 5e-6, -2e-4)),
    ],
)
def test_a_hop_is_a_bounce_of_both_corners_flicker_and_overlap_are_none(heights, count):
    device = np.column_stack([np.full(STEPS + 1, 0.05), -0.00525 - heights, np.zeros(STEPS + 1)])
    assert measures.bounces(trace(device=device)) == count


@pytest.mark.parametrize("tilt", [0.0, 0.2, -0.3])
def test_a_start_has_the_clearance_and_the_travel_it_says(tilt):
    placed = Condition(tilt, clearance=0.012, travel=0.007).place(
        load_scene(find_scene("peg_corner"))
    )
    gaps = [gap[0] for gap in measures.corner_gaps(np.array([placed.bodies[0].position]))]
    assert min(gaps[0::2]) == pytest.approx(0.012)
    assert min(gaps[1::2]) == pytest.approx(0.007)
