"""The mass matrices of random trees are positive definite."""

from __future__ import annotations

import numpy as np

from reference.random_mechanisms import random_mechanism, random_state
from verification.check import Check, Study, no_row_fails
from verification.table import Row

SIZES = (1, 3, 10, 30)  # joints
MATRICES = {"quick": 150, "full": 2000}
# Condition number of M scaled to a unit diagonal, above which rounding determines the sign of the
# least eigenvalue.
LARGEST_CONDITION = 1e12
SEED = 20050603


def _definite(study: Study, joints: int) -> Row:
    count = MATRICES[study.depth]
    rng = np.random.default_rng([SEED, joints, 1])
    conditions = []
    least = []
    for _ in range(count):
        mechanism = random_mechanism(rng, joints)
        mass = mechanism.mass_matrix(random_state(rng, mechanism)[0])
        if not len(mass) or not np.all(np.diag(mass) > 0.0):
            continue
        scale = np.sqrt(np.diag(mass))  # removes the units of the coordinates
        values = np.linalg.eigvalsh(mass / np.outer(scale, scale))
        condition = float(np.abs(values).max() / np.abs(values).min())
        if condition <= LARGEST_CONDITION:
            conditions.append(condition)
            least.append(float(values[0]) * condition)
    return {
        "joints": joints,
        "mass matrices": count,
        "judged, condition ≤ 1e12": len(conditions),
        "largest condition judged": max(conditions),
        "least eigenvalue × condition": min(least),
    }


POSITIVE_DEFINITE = Check(
    key="positive definite",
    question="Is the mass matrix positive definite wherever rounding permits a judgement?",
    cases=lambda _: SIZES,
    row=_definite,
    targets=no_row_fails("sizes of trees with a mass matrix that is not positive definite"),
    holds=lambda row: bool(row["least eigenvalue × condition"] > 0.0),
)
