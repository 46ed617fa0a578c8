"""The catalogue of hard cases. To add one, write it in impacts.yaml or as a function that returns
it, its scene in scenes.yaml; name it here."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from verification.hard_cases import friction, motions, numerical, sticking
from verification.hard_cases.case import AnyCase, FrictionalCase, HardCase, written


def written_case(name: str) -> HardCase:
    """Return an impact of impacts.yaml."""
    given = written("impacts.yaml")[name]
    arrays = {
        key: np.array(given[key], dtype=object) for key in ("M", "J", "v", "e", "T") if key in given
    }
    exact = _fractions(arrays["J"])
    numbers = {key: _fractions(array).astype(float) for key, array in arrays.items()}
    mass = numbers["M"]
    e = numbers["e"]
    arguments: dict[str, Any] = dict(
        name=given["name"],
        source=given["source"],
        why_hard=given["why hard"],
        expected=given["expected"],
        mass_matrix=np.diag(mass) if mass.ndim == 1 else mass,
        contact_jacobian=numbers["J"],
        velocity=numbers["v"],
        restitution=e if e.ndim else float(e),
        exact_jacobian=exact if "/" in str(given["J"]) else None,
        methods=tuple(given["methods"]) if "methods" in given else None,
    )
    if "T" in given:
        return FrictionalCase(**arguments, tangent=numbers["T"], friction=float(given["friction"]))
    return HardCase(**arguments)


def _fractions(array: Any) -> Any:
    """Return the array with texts such as "3/5" as fractions."""
    return np.vectorize(lambda x: Fraction(x) if isinstance(x, str) else x, otypes=[object])(array)


def _named(*cases: Callable[[], AnyCase] | str) -> dict[str, Callable[[], AnyCase]]:
    """Return functions by their names, and the cases of impacts.yaml with these names."""
    return {
        case if isinstance(case, str) else case.__name__: partial(written_case, case)
        if isinstance(case, str)
        else case
        for case in cases
    }


HARD_CASES: dict[str, Callable[[], AnyCase]] = {
    "no_contact": partial(
        numerical.contacts,
        0,
        "No contact at all",
        "libraries treat empty matrices differently",
        "the velocity does not change; no error",
    ),
    "one_contact": partial(
        numerical.contacts,
        1,
        "One contact",
        "the case is easy: every method must solve it",
        "the textbook velocity (19), v⁺ = v⁻ − (1 + e) M⁻¹Jᵀ (J M⁻¹Jᵀ)⁻¹ J v⁻, up to rounding",
    ),
    "hundred_contacts": partial(
        numerical.contacts,
        100,
        "100 contacts of rank three",
        "97 redundant rows, each exact in doubles",
        "the exact rank, and the velocity that three independent contacts give",
    ),
    **_named(numerical.thousand_copies),
    "ten_thousand_contacts": partial(
        numerical.contacts,
        10_000,
        "10,000 contacts of rank three",
        "time and memory: the Delassus matrix has 1e8 entries",
        "time in proportion to "
        "the contacts, exact rank; no method that forms the Delassus matrix is tried",
    ),
    **_named(
        "nearly_parallel_normals",
        numerical.printed_formula_gains,
        numerical.hilbert_rows,
        numerical.kahan_rows,
        "mass_ratio",
        "tiny_lever_arm",
        "straight_arm",
        "face_at_three_points",
        "grazing",
        "subnormal_speeds",
        numerical.light_direction,
        "bar_with_unequal_restitution",
        "wedged_peg",
        "touching_cradle_impact",
        "break_shot",
        "rocking_block",
        "superball",
        "stack_of_mass_ratio",
        "wedge",
        "painleve_impact",
        "sleeping_top",
        "rolling_coin",
        "rattleback",
        "double_pendulum_without_friction",
        "double_pendulum_with_friction",
    ),
    "wall_at_the_bound": partial(
        motions.wall,
        1,
        "the largest stiffness for which passivity is proved",
        "the wall creates energy in no world",
    ),
    "wall_beyond_the_bound": partial(
        motions.wall,
        500,
        "a penalty wall throws the tool back faster than it arrived",
        "the wall creates no energy: with IAPB the spring returns less than the first impulse has taken",
    ),
    "wall_far_beyond_the_bound": partial(
        motions.wall,
        2000,
        "while the contact lasts only the spring acts; half its period is about two time steps",
        "a rigid wall creates no energy. We expect IAPB and PB to fail: so stiff a spring, "
        "evaluated once a "
        "step, creates energy",
    ),
    **_named(motions.wedged_peg_motion),
    "touching_cradle": partial(motions.cradle, "touching_cradle", "touching exactly"),
    "touching_cradle_in_centimetres": partial(
        motions.cradle, "touching_cradle_in_centimetres", "touching but for rounding"
    ),
    "cradle_a_micrometre_apart": partial(
        motions.cradle, "cradle_a_micrometre_apart", "a micrometre apart"
    ),
    "cradle_a_micrometre_sunk": partial(
        motions.cradle, "cradle_a_micrometre_sunk", "sunk by a micrometre", 1e-6
    ),
    **_named(friction.double_pendulum_motion),
    "sticking_threshold": partial(
        friction.pushed,
        0.99,
        "Sticking, 1 % below the threshold",
        "the block sticks. All worlds have Coulomb's law here; with the paper's law (6), "
        "which is viscous below 1 mm/s, the block would creep",
    ),
    "sliding_threshold": partial(
        friction.pushed,
        1.01,
        "Sliding, 1 % above the threshold",
        "the block slides by ½ 0.01 μ g t². All worlds have Coulomb's law here; with the "
        "paper's law (6), viscous below 1 mm/s, it would slide nearly t × 1 mm/s farther",
    ),
    **_named(
        friction.creep_of_the_regularised_law,
        friction.painleve_rod,
        friction.stick_slip,
        sticking.nudged_box,
    ),
    "box_on_a_slope": partial(sticking.on_a_slope, "box_on_a_slope"),
    "stack_on_a_slope": partial(sticking.on_a_slope, "stack_on_a_slope"),
    **_named(motions.chatter),
}
