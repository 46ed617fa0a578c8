"""An impact that broke a law, as a run file: a run that ends in its first impact, with the input of the impact.

The laws are tested on impacts given only by numbers, M, J, v and e, without a scene. So the run has no step, no
configuration, no body and no contact point. It has only its first state with the velocity before the impact, and in
/impacts the velocity after it, once for each row budget that the law tests. Unknown values are marked: the rank is −1,
the number of closing rows is counted or −1, the clamp is NaN, the unit of a velocity is 1. The text /struck has the
`BrokenImpact` as JSON, every digit.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from iapb.run import ContactTable, ImpactTable, Run, digests
from iapb.schema import blank, quantities
from reports.store.io import opened, read_values, write_text
from reports.store.keys import plain
from reports.store.runs import write_run
from verification.impacts import Floats, ImpactCase
from verification.laws.counterexample import Struck

STRUCK = "struck"
_SOURCE = "# An impact of bare numbers, no scene: see the group /struck of this file.\n"


@dataclass(frozen=True)
class BrokenImpact:
    """An impact, the law it breaks, and how it was found.

    found : the data that draw the impact again (resolver, seed, part, index), as a mapping of plain values.
    value, tolerance : residual of the law when the impact was found, and its tolerance; test : source code of a test.
    """

    struck: Struck
    resolver: str
    law: str
    statement: str
    value: float
    tolerance: float
    found: dict[str, Any]
    test: str

    def words(self) -> str:
        """Return one line: the broken law, the residual, and the message of the resolver."""
        said = f"; {self.struck.complaint}" if self.struck.complaint else ""
        return f"the impact breaks {self.law}: {self.value:.3g} where {self.tolerance:.3g} is allowed{said}"


def write_broken_impact(path: Path, broken: BrokenImpact) -> Path:
    """Write one run file; the same impact again gives the same file."""
    text = json.dumps(plain(broken), ensure_ascii=False)
    return write_run(path, impact_run(broken), replace=True, more=lambda file: write_text(file, STRUCK, text))


def impact_run(broken: BrokenImpact) -> Run:
    """Return the impact as a run that stops in the impact of its first step."""
    case, rows = broken.struck.case, broken.struck.rows
    mass, before = np.asarray(case.mass_matrix, np.float64), np.asarray(case.velocity, np.float64)
    d, k = case.coordinates, len(rows)
    after = np.array(broken.struck.velocity_after, np.float64)
    lengths = {"time": 1, "step": 0, "step_edge": 1, "contact": 0, "axis": 3, "coordinate": 0, "velocity": d,
               "device_coordinate": 0, "device_velocity": 0, "body": 0, "placement": 3, "impact": k}  # fmt: skip
    none = {"coordinate_names": (), "coordinate_units": (), "body_names": (), "scene_resolved": {}, "energy": {},
            "coupling_settings": {}, "tool_dofs": (0, 0), "tool_coordinates": (0, 0), "effects": ()}  # fmt: skip
    arrays = blank((*quantities(Run, "time"), *quantities(Run, "step")), lengths)
    arrays["v"][0] = before
    with np.errstate(over="ignore", invalid="ignore"):  # a broken impact may be of any size
        impulse = (after - before) @ mass.T
        closing = np.sum(after @ np.asarray(case.contact_jacobian).T < 0.0, axis=1)
    given = np.all(np.isfinite(after), axis=1)
    impacts = ImpactTable(**blank(quantities(ImpactTable), lengths) | {
        "v_minus": np.tile(before, (k, 1)), "v_plus": after, "impulse": impulse, "rows": np.array(rows, np.int64),
        "rank": np.full(k, -1), "scale": np.ones(k), "clamp": np.full(k, np.nan), "friction_share": np.ones(k),
        "energy_lost": np.array([_energy_lost(mass, before, one) if fine else np.nan
                                 for one, fine in zip(after, given, strict=True)]),
        "approaching": np.where(given, closing, -1), "mass_digest": np.repeat(digests(mass[None]), k)})  # fmt: skip
    return Run(scene_name=f"impact: {case.family or 'of bare numbers'}", scene_source=_SOURCE, world="no world",
               law=broken.resolver, law_settings={"restitution": np.asarray(case.given_restitution()).tolist()},
               coupling="none", dt=0.0, complete=False, stopped=broken.words(), kernel="none",
               velocity_names=tuple(f"v_{k}" for k in range(d)), velocity_units=("1",) * d, time=np.zeros(1),
               contacts=ContactTable(**blank(quantities(ContactTable), lengths)), impacts=impacts,
               **none, **arrays)  # type: ignore[arg-type]  # fmt: skip


def _energy_lost(mass: Floats, before: Floats, after: Floats) -> float:
    """Return ½ v⁻·M v⁻ − ½ v⁺·M v⁺, computed exactly and rounded once: a gain can be as small as the rounding error."""
    a, b = ([Fraction(float(x)) for x in v] for v in (before, after))
    terms = (Fraction(float(m)) * (a[i] * a[j] - b[i] * b[j]) for (i, j), m in np.ndenumerate(mass))
    lost = sum(terms, Fraction(0)) / 2
    try:
        return float(lost)
    except OverflowError:
        return np.inf if lost > 0 else -np.inf


def read_broken_impact(path: Path | str) -> BrokenImpact | None:
    """Return the broken impact in a run file, or None for a run of another kind.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a run.
    """
    with opened(path) as file:
        if STRUCK not in file:
            return None
        told = json.loads(read_values(file, STRUCK, str(path)))
        struck, case = told["struck"], told["struck"]["case"]
        rows, d = tuple(map(int, struck["rows"])), len(case["velocity"])
        shapes = {"mass_matrix": (d, d), "contact_jacobian": (-1, d), "translations": (-1, d), "touching": (-1, d)}
        arrays = {name: np.array(value, np.float64).reshape(shapes.get(name, np.shape(value)))
                  for name, value in case.items() if isinstance(value, list)}  # fmt: skip
        after = np.array(struck["velocity_after"], np.float64).reshape(len(rows), d)
        return BrokenImpact(**told | {"struck": Struck(ImpactCase(**case | arrays), rows, after, struck["complaint"])})
