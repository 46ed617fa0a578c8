"""An impact that broke a law, as a run file: a run that ends in its first impact, with the input of the impact.

The laws are tested on impacts given only by numbers, M, J, v and e, without a scene. So the run has no step, no
configuration, no body and no contact point. It has only its first state with the velocity before the impact, and in
/impacts the velocity after it, once for each row budget that the law tests. Unknown values are marked: the rank is −1,
the number of closing rows is counted or −1, the clamp is NaN, the unit of a velocity is 1. Group /struck has the rest:

    mass_matrix (d, d), contact_jacobian (c, d), velocity (d,), restitution (c,)   the input
    velocity_after (k, d), residual, tolerance                                     the result
    translations (t, d)                                                            motions z with J z = 0, if known
    law, statement, found, test                                                    texts: `found` is JSON
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import RunFileError
from iapb.run import ContactTable, ImpactTable, Run, digests
from iapb.schema import blank, quantities
from reports.store.io import opened, read_values, write_quantity, write_scale, write_text
from reports.store.runs import write_run
from verification.impacts import Floats, ImpactCase
from verification.laws.counterexample import Struck

STRUCK = "struck"
_SOURCE = "# An impact of bare numbers, no scene: see the group /struck of this file.\n"
_TEXTS = ("law", "statement", "found", "test")


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
    return write_run(path, impact_run(broken), replace=True, more=lambda file: _write(file, broken))


def impact_run(broken: BrokenImpact) -> Run:
    """Return the impact as a run that stops in the impact of its first step."""
    case, after = broken.struck.case, broken.struck.velocity_after
    d = case.coordinates
    lengths = {"time": 1, "step": 0, "step_edge": 1, "contact": 0, "axis": 3, "coordinate": 0, "velocity": d,
               "device_coordinate": 0, "device_velocity": 0, "body": 0, "placement": 3}  # fmt: skip
    none = {"coordinate_names": (), "coordinate_units": (), "body_names": (), "scene_resolved": {}, "energy": {},
            "coupling_settings": {}, "tool_dofs": (0, 0), "tool_coordinates": (0, 0), "effects": ()}  # fmt: skip
    arrays = blank((*quantities(Run, "time"), *quantities(Run, "step")), lengths)
    arrays["v"][0] = case.velocity
    return Run(scene_name=f"impact: {case.family or 'of bare numbers'}", scene_source=_SOURCE, world="no world",
               law=broken.resolver, law_settings={"restitution": np.asarray(case.given_restitution()).tolist()},
               coupling="none", dt=0.0, complete=False, stopped=broken.words(), kernel="none",
               velocity_names=tuple(f"v_{k}" for k in range(d)), velocity_units=("1",) * d, time=np.zeros(1),
               contacts=ContactTable(**blank(quantities(ContactTable), lengths)),
               impacts=_impacts(case, broken.struck.rows, after), **none, **arrays)  # type: ignore[arg-type]  # fmt: skip


def _impacts(case: ImpactCase, rows: tuple[int, ...], velocity_after: Floats) -> ImpactTable:
    """Return an impact table with one row per velocity after; the impulse is M (v⁺ − v⁻) for every resolver."""
    k, v, after = len(rows), np.array(case.velocity, np.float64), np.array(velocity_after, np.float64)
    with np.errstate(over="ignore", invalid="ignore"):  # a broken impact may be of any size
        impulse = (after - v) @ np.asarray(case.mass_matrix, np.float64).T
        closing = np.sum(after @ np.asarray(case.contact_jacobian, np.float64).T < 0.0, axis=1)
    given = np.all(np.isfinite(after), axis=1)
    lost = [_energy_lost(case.mass_matrix, v, one) if fine else np.nan for one, fine in zip(after, given, strict=True)]
    return ImpactTable(
        step=np.zeros(k, np.int64), group=np.zeros(k, np.int64), v_minus=np.tile(v, (k, 1)), v_plus=after,
        impulse=impulse, rows=np.array(rows, np.int64), rank=np.full(k, -1, np.int64), energy_lost=np.array(lost),
        scale=np.ones(k), clamp=np.full(k, np.nan), friction_share=np.ones(k),
        approaching=np.where(given, closing, -1).astype(np.int64), solved=np.zeros(k, np.bool_),
        mass_digest=np.repeat(digests(np.asarray(case.mass_matrix, np.float64)[None]), k))  # fmt: skip


def _energy_lost(mass: Floats, before: Floats, after: Floats) -> float:
    """Return ½ v⁻·M v⁻ − ½ v⁺·M v⁺, computed exactly and rounded once, because a gain can be as small as the rounding
    error of either energy."""
    a, b = ([Fraction(float(x)) for x in v] for v in (before, after))
    terms = (Fraction(float(m)) * (a[i] * a[j] - b[i] * b[j]) for (i, j), m in np.ndenumerate(mass))
    lost = sum(terms, Fraction(0)) / 2
    try:
        return float(lost)
    except OverflowError:
        return np.inf if lost > 0 else -np.inf


def _write(file: Any, broken: BrokenImpact) -> None:
    group, case = file.create_group(STRUCK), broken.struck.case
    e = np.atleast_1d(np.asarray(case.given_restitution(), np.float64))
    lengths = {"equation": case.coordinates, "coordinate": case.coordinates, "contact": case.contacts,
               "given": len(e), "answer": len(broken.struck.rows)}  # fmt: skip
    if case.translations is not None:
        lengths["translation"] = len(case.translations)
    for name, length in lengths.items():
        write_scale(group, name, np.arange(length), "1")
    write_quantity(group, "mass_matrix", case.mass_matrix, ("equation", "coordinate"), "1", "M")
    write_quantity(group, "contact_jacobian", case.contact_jacobian, ("contact", "coordinate"), "1", "J, a row each")
    write_quantity(group, "velocity", case.velocity, ("coordinate",), "1", "v before")
    write_quantity(group, "restitution", e, ("given",), "1", "one for all rows, or one for each")
    after = broken.struck.velocity_after
    write_quantity(group, "velocity_after", after, ("answer", "coordinate"), "1", "v after, as the resolver gave it")
    if case.translations is not None:
        write_quantity(group, "translations", case.translations, ("translation", "coordinate"), "1", "z with J z = 0")
    group.attrs.update({"residual": broken.value, "tolerance": broken.tolerance, "family": case.family,
                        "one_restitution": case.unequal is None, "equal_restitution": case.restitution,
                        "complaint": broken.struck.complaint, "resolver": broken.resolver})  # fmt: skip
    for name in _TEXTS:
        value = getattr(broken, name)
        write_text(group, name, value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, indent=1))


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
        group, place = file[STRUCK], str(path)
        texts = {name: read_values(group, name, place) for name in _TEXTS}
        arrays = {name: np.asarray(read_values(group, name, place), np.float64) for name in
                  ("mass_matrix", "contact_jacobian", "velocity", "restitution", "velocity_after")}  # fmt: skip
        moves = read_values(group, "translations", place) if "translations" in group else None
        head = dict(group.attrs)
        rows = tuple(int(x) for x in read_values(file["impacts"], "rows", place))
        return _broken(texts, arrays, moves, head, rows, place)


def _broken(texts: dict[str, str], arrays: dict[str, Any], moves: Any, head: dict[str, Any], rows: tuple[int, ...],
            place: str) -> BrokenImpact:
    after, e, found = arrays.pop("velocity_after"), arrays.pop("restitution"), json.loads(texts["found"])
    d = len(arrays["velocity"])
    shapes = (arrays["mass_matrix"].shape, arrays["contact_jacobian"].shape[1:], after.shape)
    if shapes != ((d, d), (d,), (len(rows), d)) or not {"part", "index", "request"} <= set(found):
        raise RunFileError(f"{place}: /{STRUCK} is no impact")
    case = ImpactCase(**arrays, restitution=float(head["equal_restitution"]), family=str(head["family"]),
                      translations=moves, unequal=None if head["one_restitution"] else e)  # fmt: skip
    return BrokenImpact(Struck(case, rows, after, str(head["complaint"])), str(head["resolver"]), texts["law"],
                        texts["statement"], float(head["residual"]), float(head["tolerance"]), found,
                        texts["test"])  # fmt: skip
