"""Friction and unequal restitution beside their complementarity counterparts."""

from __future__ import annotations

import numpy as np

from verification.complementarity.extensions import compare_friction, compare_unequal, struck_bar


def test_friction_is_coulombs_law_where_all_push_and_never_gains() -> None:
    cells = compare_friction(15, (0.0, 1.0), (0.2, 0.8))
    assert sum(c.pushing for c in cells) > 10
    assert all(c.same == c.pushing for c in cells)
    assert max(c.largest_gain for c in cells) <= 1e-12
    assert all(c.ncp_gains == 0 for c in cells if c.restitution == 0.0)
    assert any(c.ncp_gains > 0 and c.reduced > 0 for c in cells if c.restitution == 1.0)


def test_unequal_restitution_is_poissons_law_and_never_gains() -> None:
    approaching, mixed = compare_unequal(40)
    assert max(approaching.distance, mixed.distance) <= 1e-12
    assert max(approaching.gain, mixed.gain) <= 1e-12
    assert approaching.gain_newton_lcp <= 1e-12 < mixed.gain_newton_lcp
    assert approaching.gain_equality > 0.1


def test_the_struck_bar_has_the_energies_of_the_textbook_of_this_project() -> None:
    energies = struck_bar()
    assert np.isclose(energies["newton_equality"], 73.0 / 6.0)
    assert energies["IAPB, unequal restitution"] <= 0.5 and np.isclose(energies["newton_lcp"], 0.5)
