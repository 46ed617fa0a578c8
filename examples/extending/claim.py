"""A claim: a plastic impact, resolved a second time, changes nothing more.

In the project it is a file of verification/claims, named in `_FILES` there. The conditions are the
columns in which a region is searched where the claim holds in part.

Prints:
    holds
"""

import numpy as np

from iapb import resolve_impact
from verification.check import Check, Study
from verification.claims import CLAIMS, check_claims
from verification.impacts import Family, draw_of_rank
from verification.table import Columns, Row


def contacts(study: Study) -> tuple[int, ...]:
    """Return the cases: numbers of contacts."""
    return (1, 4, 20)


def resolved_twice(study: Study, contacts: int) -> Row:
    """Return the row of one number of contacts: the largest change by the second impact."""
    family = Family(6, contacts, min(contacts, 4), 1e4)
    changes = []
    for case in draw_of_rank(family, {"quick": 20, "full": 300}[study.depth], study.seed):
        mass, jacobian, velocity = case.arrays
        once = resolve_impact(mass, jacobian, velocity, 0.0).velocity
        twice = resolve_impact(mass, jacobian, once, 0.0).velocity
        changes.append(float(np.abs(twice - once).max() / np.abs(velocity).max()))
    rounding = 100 * family.coordinates * np.finfo(float).eps * family.condition_number
    return {
        "contacts": contacts,
        "impacts": len(changes),
        "change": max(changes),
        "bound": rounding,
    }


def stays(row: Row) -> bool:
    """Return whether the change is rounding."""
    return bool(row["change"] <= row["bound"])


U01 = Check(
    key="U01",
    question="A plastic impact, resolved twice, is resolved once.",
    cases=contacts,
    row=resolved_twice,
    holds=stays,
    columns=Columns(conditions=("contacts",), counts=("impacts",)),
)
CLAIMS["U01"] = U01

print(check_claims(ids=["U01"])[0].outcome)
