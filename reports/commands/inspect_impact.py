"""What `iapb inspect` says about an impact that broke a law."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from reports.store_impact import BrokenImpact


def describe_impact(broken: BrokenImpact, file: Path) -> None:
    """Say which law was broken, by what, how it was found, and give the test to paste."""
    case = broken.struck.case
    print(f"An impact of {broken.resolver} that breaks a law, {broken.law}: {broken.statement}.")
    print(f"Residual {broken.value:.6g}, allowed {broken.tolerance:.6g}.")
    if broken.struck.complaint:
        print(f"The resolver: {broken.struck.complaint}.")
    print(f"{case.contacts} rows on {case.coordinates} coordinates ({case.family or 'no family'}), in bare numbers.")
    origin = broken.found
    print(f"Found as case {origin['index']} of the part {origin['part']!r}, seed {origin['request']['seed']}. "
          f"Judged again by: iapb verify --recheck {file}")
    given = {"mass matrix M": case.mass_matrix, "contact Jacobian J": case.contact_jacobian,
             "velocity before": case.velocity, "restitution": case.given_restitution(),
             "velocity after": broken.struck.velocity_after}  # fmt: skip
    for name, values in given.items():
        print(f"\n{name}:\n{np.array2string(np.asarray(values), precision=6, prefix='  ', max_line_width=110)}")
    print(f"\nAs a test, every digit:\n\n{broken.test}\n")
