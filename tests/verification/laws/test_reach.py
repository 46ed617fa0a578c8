"""How far the kit reaches: resolvers that are sound but for a rare or remote condition, and after
how many impacts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from verification.impacts import Floats, draw_rows, draw_velocity
from verification.laws import check_passivity, sound_resolver

Condition = Callable[[Floats, Floats, Floats, Any], bool]


def _where(condition: Condition) -> Callable[..., Floats]:
    """A resolver whose v⁺ is 1e-3 too fast under a condition: energy is made where e is near
    one."""
    return lambda *impact: sound_resolver(*impact) * (1.001 if condition(*impact) else 1.0)


# condition of an error -> impacts within which the kit must find it
CONDITIONS: dict[str, tuple[Condition, int]] = {
    "d > 35": (lambda M, J, v, e: len(v) > 35, 200),
    "c > 400": (lambda M, J, v, e: len(J) > 400, 400),
    "M below 1e-6": (lambda M, J, v, e: M.max() < 1e-6, 50),
    "an entry of J above 1e5": (lambda M, J, v, e: np.abs(J).max(initial=0.0) > 1e5, 50),
    "speeds below 1e-6": (lambda M, J, v, e: 0.0 < np.abs(v).max() < 1e-6, 100),
}
UNSOUND: dict[str, tuple[Callable[..., Floats], int]] = {
    **{name: (_where(condition), impacts) for name, (condition, impacts) in CONDITIONS.items()},
    "rows shorter than 1e-9 dropped": (
        lambda M, J, v, e: sound_resolver(M, J[np.linalg.norm(J, axis=1) > 1e-9], v, e),
        50,
    ),
    "twelve rows at most": (lambda M, J, v, e: sound_resolver(M, J[:12], v, e), 50),
    "1e-12 m/s from rest": (
        lambda M, J, v, e: sound_resolver(M, J, v, e) + (0.0 if v.any() else 1e-12),
        50,
    ),
    "1e-10 added to the diagonal of M": (
        lambda M, J, v, e: sound_resolver(M + 1e-10 * np.eye(len(v)), J, v, e),
        50,
    ),
}


@pytest.mark.parametrize("name", UNSOUND)
def test_every_unsound_resolver_is_found(name: str) -> None:
    resolver, impacts = UNSOUND[name]
    laws = ["kinetic_energy", "restitution"] if name in CONDITIONS else None
    report = check_passivity(resolver, impacts=impacts, search=0, laws=laws)
    assert not report.passed and report.broken_laws, report


def test_rows_and_velocities_are_what_their_kinds_say() -> None:
    rng = np.random.default_rng(0)
    mass = np.eye(4)
    opposed, _ = draw_rows(rng, "opposed", mass, 6)
    assert np.array_equal(opposed[:3], -opposed[3:])
    for kind, least, most in (("unseen", -1.0, 1e-15), ("grazing", 1e-12, 1e-7)):
        v = draw_velocity(rng, kind, mass, opposed[:2])
        assert least < np.abs(opposed[:2] @ v).max() < most
