"""The power balance closes to the order of each integrator; without a term it does not close at all."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.mechanics.mechanism import Mechanism
from verification.check import Study
from verification.mechanics import power_balance as study


@pytest.mark.parametrize("joints", [1, 4, 12])
def test_every_integrator_closes_the_balance_to_its_order(joints):
    for name in study.METHODS:
        assert study.as_declared(study._row(Study(), (name, joints)))


@pytest.mark.parametrize("term", ["bias", "gravity"])
def test_a_missing_term_is_seen(term, monkeypatch):
    monkeypatch.setattr(Mechanism, term, lambda self, *given: np.zeros(self.nv))
    assert not study.as_declared(study._row(Study(), ("midpoint", 6)))


def test_mass_matrices_are_positive_definite_and_one_that_is_not_fails(monkeypatch):
    original = Mechanism.mass_matrix

    def broken(self, q):
        mass = original(self, q)
        return mass - 2.0 * np.linalg.eigvalsh(mass)[0] * np.eye(len(mass))

    monkeypatch.setattr(study, "TREES", {"quick": 3})
    monkeypatch.setattr(study, "SIZES", (3,))
    assert study.POSITIVE_DEFINITE.table(Study()).passed
    monkeypatch.setattr(Mechanism, "mass_matrix", broken)
    assert study.POSITIVE_DEFINITE.table(Study()).passed is False
