"""The catalogue. To add a case: a function that returns a HardCase (numerical.py, mechanical.py), and a line here."""

from __future__ import annotations

from collections.abc import Callable

from verification.hard_cases import mechanical, numerical
from verification.hard_cases.case import HardCase

HARD_CASES: dict[str, Callable[[], HardCase]] = {
    case.__name__: case
    for case in (
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
    )
}
