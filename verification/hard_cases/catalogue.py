"""The catalogue. To add a case: a function that returns a HardCase or a TrajectoryCase, and a line here."""

from __future__ import annotations

from collections.abc import Callable

from verification.hard_cases import (
    chatter,
    kane_levinson,
    mechanical,
    numerical,
    rough_floor,
    shared_problems,
    stiff_wall,
    wedged_peg,
)
from verification.hard_cases.case import AnyCase

HARD_CASES: dict[str, Callable[[], AnyCase]] = {
    case.__name__: case
    for case in (
        numerical.no_contact,
        numerical.one_contact,
        numerical.hundred_contacts,
        numerical.thousand_copies,
        numerical.ten_thousand_contacts,
        numerical.nearly_parallel_normals,
        numerical.printed_formula_gains,
        numerical.hilbert_rows,
        numerical.kahan_rows,
        mechanical.mass_ratio,
        mechanical.tiny_lever_arm,
        mechanical.straight_arm,
        mechanical.face_at_three_points,
        mechanical.grazing,
        mechanical.subnormal_speeds,
        mechanical.light_direction,
        mechanical.bar_with_unequal_restitution,
        wedged_peg.wedged_peg,
        kane_levinson.double_pendulum_without_friction,
        kane_levinson.double_pendulum_with_friction,
        shared_problems.bowl_of_low_rank,
        shared_problems.bowl_of_mixed_scales,
        stiff_wall.wall_at_the_bound,
        stiff_wall.wall_beyond_the_bound,
        stiff_wall.wall_far_beyond_the_bound,
        wedged_peg.wedged_peg_motion,
        kane_levinson.double_pendulum_motion,
        rough_floor.sticking_threshold,
        rough_floor.sliding_threshold,
        rough_floor.painleve_rod,
        chatter.chatter,
        shared_problems.two_balls_and_a_wall,
    )
}
