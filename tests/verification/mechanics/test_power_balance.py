"""The power balance closes to the order of each integrator; without a term it does not close at all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.mechanics.integrators import INTEGRATORS
from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_mechanism, random_state
from verification.check import Study
from verification.mechanics import power_balance as study

NEGLIGIBLE = 1e-10  # a defect this small, relative, shows rounding rather than an order


@pytest.mark.parametrize("joints", [1, 4, 12])
def test_every_integrator_closes_the_balance_to_its_order(joints):
    for name in study.METHODS:
        assert study.as_declared(study._row(Study(), (name, joints)))


@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_every_tree_closes_the_balance_better_with_a_shorter_step(seed, joints):
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, joints, ("revolute", "prismatic", "spherical", "free_flyer", "planar"))
    q, v = random_state(rng, mechanism, study.SPEED)
    if study._condition(mechanism.mass_matrix(q)) > 1e6:
        return  # so stiff that no common step shows an order
    tau = mechanism.inverse_dynamics(q, v, rng.normal(size=mechanism.nv), study.FIELD)
    method, dt = INTEGRATORS["midpoint"], 1e-3 / joints
    coarse, fine = (study.defect(mechanism, method, q, v, tau, h) for h in (dt, dt / 4))
    assert fine <= max(coarse / 4, NEGLIGIBLE)


@pytest.mark.parametrize("term", ["bias", "gravity"])
def test_a_missing_term_is_seen(term, monkeypatch):
    monkeypatch.setattr(Mechanism, term, lambda self, *given: np.zeros(self.nv))
    assert not study.as_declared(study._row(Study(), ("midpoint", 6)))


def test_mass_matrices_are_positive_definite(monkeypatch):
    monkeypatch.setattr(study, "TREES", {"quick": 3})
    finding = study.POSITIVE_DEFINITE.table(Study())
    assert finding.passed and finding.column("joints") == list(study.SIZES)


def test_an_indefinite_mass_matrix_fails(monkeypatch):
    original = Mechanism.mass_matrix

    def broken(self, q):
        mass = original(self, q)
        return mass - 2.0 * np.linalg.eigvalsh(mass)[0] * np.eye(len(mass))

    monkeypatch.setattr(study, "TREES", {"quick": 3})
    monkeypatch.setattr(study, "SIZES", (3,))
    monkeypatch.setattr(Mechanism, "mass_matrix", broken)
    assert study.POSITIVE_DEFINITE.table(Study()).passed is False
