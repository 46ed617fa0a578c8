"""Mass matrices of random trees are positive definite, and one that is not fails."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.mechanics.mechanism import Mechanism
from iapb.numerics.schema import Floats
from verification.check import Study
from verification.mechanics import definiteness as study


def test_mass_matrices_are_positive_definite_and_one_that_is_not_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    original = Mechanism.mass_matrix

    def broken(self: Mechanism, q: Floats) -> Floats:
        mass = original(self, q)
        return mass - 2.0 * np.linalg.eigvalsh(mass)[0] * np.eye(len(mass))

    monkeypatch.setattr(study, "MATRICES", {"quick": 30})
    monkeypatch.setattr(study, "SIZES", (3,))
    assert study.POSITIVE_DEFINITE.table(Study()).passed
    monkeypatch.setattr(Mechanism, "mass_matrix", broken)
    assert study.POSITIVE_DEFINITE.table(Study()).passed is False
