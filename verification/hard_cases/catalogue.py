"""The catalogue of hard cases. To add a case, write a function that returns it and add a line here."""

from __future__ import annotations

from collections.abc import Callable

from verification.hard_cases import (
    bodies,
    friction,
    mechanical,
    motions,
    numerical,
    shared_problems,
    sticking,
)
from verification.hard_cases.case import AnyCase

HARD_CASES: dict[str, Callable[[], AnyCase]] = {
    case.__name__: case
    for case in (
        numerical.no_contact, numerical.one_contact, numerical.hundred_contacts, numerical.thousand_copies,
        numerical.ten_thousand_contacts, numerical.nearly_parallel_normals, numerical.printed_formula_gains,
        numerical.hilbert_rows, numerical.kahan_rows,
        mechanical.mass_ratio, mechanical.tiny_lever_arm, mechanical.straight_arm,
        mechanical.face_at_three_points, mechanical.grazing, mechanical.subnormal_speeds,
        mechanical.light_direction, mechanical.bar_with_unequal_restitution, mechanical.wedged_peg,
        bodies.touching_cradle_impact, bodies.break_shot, bodies.rocking_block, bodies.superball,
        bodies.stack_of_mass_ratio, bodies.wedge, bodies.painleve_impact, bodies.sleeping_top,
        bodies.rolling_coin, bodies.rattleback,
        friction.double_pendulum_without_friction, friction.double_pendulum_with_friction,
        shared_problems.bowl_of_low_rank, shared_problems.bowl_of_mixed_scales,
        motions.wall_at_the_bound, motions.wall_beyond_the_bound, motions.wall_far_beyond_the_bound,
        motions.wedged_peg_motion, motions.touching_cradle, motions.touching_cradle_in_centimetres,
        motions.cradle_a_micrometre_apart, motions.cradle_a_micrometre_sunk,
        friction.double_pendulum_motion, friction.sticking_threshold, friction.sliding_threshold,
        friction.creep_of_the_regularised_law, friction.painleve_rod, friction.stick_slip,
        sticking.nudged_box, sticking.box_on_a_slope, sticking.stack_on_a_slope,
        motions.chatter,
        shared_problems.two_balls_and_a_wall,
    )
}  # fmt: skip
