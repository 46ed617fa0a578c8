"""Certify from M, v⁻ and v⁺ whether a recorded impact gained kinetic energy in exact arithmetic.

Every double is an integer times a power of two, so integer arithmetic decides exactly whether
v⁺ᵀMv⁺ ≤ v⁻ᵀMv⁻. A proved error bound in double-double (`iapb.contact.kernels.passive`) decides
almost every impact. Integer arithmetic decides the impacts whose sign the bound leaves open, and
confirms the bound for one impact in a hundred. The recorded energies are not used, so impacts of
other engines are judged in the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.kernels.passive import gain_signs
from iapb.contact.laws import ENGINE_LAWS, ImpulseAugmented
from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.bodies import real_numbers
from iapb.numerics.schema import Booleans, Floats, Integers
from iapb.run import ContactTable, ImpactTable, Run, digests
from iapb.scene.mechanism import mechanism_of, start_of
from iapb.scene.reading import scene_from_values
from iapb.system import system_of
from reference.exact import relative_energy_gain, whole_numbers

# M (n or 1, d, d), v⁻, v⁺ (n, d), and M (v⁺ − v⁻) as recorded
Batch = tuple[Floats, Floats, Floats, Floats | None]
Table = TypeVar("Table", ContactTable, ImpactTable)

EXPORT_HEAD = "iapb impacts 2"  # first line of a file of exported impacts
_CHECKED = 100  # integers confirm one in so many of the impacts that the bound decides
_EPSILON = np.finfo(float).eps
_BATCH = 4096  # impacts whose mass matrices are in memory at once
_PIECE = 1 << 18  # coordinates and contacts, on average, of the steps that are in memory at once
_INDEFINITE = (
    1e-12  # a negative eigenvalue of M beyond this share of the largest one is no rounding
)
# In a correct record, M (v⁺ − v⁻) and Jᵀp of the recorded contacts equal the recorded impulse up to
# rounding.
MOMENTUM_TOLERANCE = 1e-9
# The resolver drops rows within 1e-10 of the span of others; their residual is √κ(M) times larger:
# 1e-6 at κ(M) = 1e8.
RESTITUTION_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Certificate:
    """The result of judging recorded impacts exactly.

    Attributes
    ----------
    impacts : number of impacts judged.  gains : number of these that gained kinetic energy, even in
        the last bit.
    by_integers : number of impacts that the floating-point bound could not decide and integer
        arithmetic did.
    checked : number of bounds confirmed by integer arithmetic.
    first_gain : index of the first impact that gained, −1 = none.
    largest_gain : largest relative gain (KE⁺ − KE⁻)/KE⁻, 0 if none gained.
    momentum : largest |M(v⁺ − v⁻) − recorded impulse| beyond the rounding of v⁺, relative to the sum
        of |M||v⁺ − v⁻| and the recorded impulse; NaN if no impulse is recorded.
    span : largest |Jᵀp − recorded impulse|, relative to the sum of both sizes. J and p hold the
        normals and impulses of the recorded contacts, so this is the distance of the impulse from
        range(Jᵀ). NaN with friction in impacts or per-body rows.
    total : largest |sum of the impulses of a step's impacts − the step's recorded impulse|,
        relative to the sum of their sizes. It is 1 if a step has an impulse and no impact, and NaN
        if no steps are recorded.
    restitution : largest |J v⁺ + e J v⁻| of the contacts with an impulse, relative to |J||v⁻|; NaN
        if no impact has to meet J v⁺ = −e J v⁻. Where impacts of a step move the same bodies one
        after the other, it is not judged. Nor are impacts of several contacts by Poisson's law.
    restitution_judged : whether a large restitution residual makes the certificate fail. This holds
        for law (21) without options, one scalar e, and only independent rows. Otherwise the
        residual is only reported.
    counterexample : Python source, ready to paste, that shows the first gain in rationals; empty if
        there is no gain.
    """

    impacts: int
    gains: int
    by_integers: int
    checked: int
    first_gain: int
    largest_gain: float
    momentum: float
    span: float = np.nan
    restitution: float = np.nan
    counterexample: str = ""
    total: float = np.nan
    restitution_judged: bool = False

    @property
    def _shares(self) -> dict[str, float]:
        """Residual over tolerance of each condition other than energy; NaN if it is not judged."""
        return {
            "momentum M(v⁺ − v⁻)": self.momentum / MOMENTUM_TOLERANCE,
            "impulses in range(Jᵀ)": self.span / MOMENTUM_TOLERANCE,
            "sum of a step's impulses": self.total / MOMENTUM_TOLERANCE,
            "restitution": self.restitution / RESTITUTION_TOLERANCE
            if self.restitution_judged
            else np.nan,
        }

    @property
    def passed(self) -> bool:
        """No impact gained energy, and every judged residual is within its tolerance (NaN: not
        judged)."""
        return self.gains == 0 and not any(share > 1.0 for share in self._shares.values())

    def words(self) -> str:
        """Return one line that says what is certified, what fails and what is not judged."""
        shares = self._shares.items()
        wrong = [name for name, share in shares if share > 1.0]
        held = [name for name, share in shares if share <= 1.0]
        unjudged = [name for name, share in shares if np.isnan(share)]
        if not self.impacts:
            unfit = f"no impact, and what is recorded does not fit: {', '.join(wrong)}"
            return unfit if wrong else "no impact: nothing to certify"
        if self.gains:
            energy = (
                f"{self.gains} of {self.impacts} impacts gained energy (exact). Springs return "
                "stored energy: judge such a contact from first touch to last."
            )
        else:
            energy = f"none of {self.impacts} impacts gained energy, not in the last bit (exact)."
            held = ["no gain", *held]
        if "restitution" in unjudged and not np.isnan(self.restitution):
            unjudged[unjudged.index("restitution")] = "restitution (only reported)"
        fits = f" Recorded impulses and velocities do not fit: {'; '.join(wrong)}." if wrong else ""
        return (
            f"{energy} Certified: {'; '.join(held) or 'nothing'}.{fits} "
            f"Not judged: {'; '.join([*unjudged, 'forces between impacts'])}."
        )

    __str__ = words


def exact_gain(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> Fraction:
    """KE⁺ − KE⁻ = ½ (v⁺ᵀMv⁺ − v⁻ᵀMv⁻) as a rational number."""
    M, unit = whole_numbers("mass_matrix", mass_matrix)
    v, speed_unit = whole_numbers("velocities", [v_minus, v_plus])
    total = v[1] @ M @ v[1] - v[0] @ M @ v[0]
    return Fraction(total) * Fraction(2) ** (unit + 2 * speed_unit - 1)


def _finite(name: str, values: ArrayLike) -> Floats:
    """Return the values as a contiguous array of doubles."""
    given = real_numbers(values)
    if given is None:
        raise ArgumentError(name, values, "an array of real numbers")
    with np.errstate(over="ignore"):
        array = np.ascontiguousarray(given, np.float64)
    for place in np.argwhere(~(np.isfinite(array) & (array == given)))[:1]:
        where = f"{name}[{', '.join(map(str, place))}]" if len(place) else name
        raise ArgumentError(
            where, float(given[tuple(place)]), "a finite number that a double holds"
        )
    return array


def _impacts(mass_matrix: ArrayLike, v_minus: ArrayLike, **others: ArrayLike) -> list[Floats]:
    """Return M (1, d, d) or (n, d, d), v⁻ and the others (n, d), checked."""
    masses = _finite("mass_matrix", mass_matrix)
    before = np.atleast_2d(_finite("v_minus", v_minus))
    masses = masses[None] if masses.ndim == 2 else masses
    if before.ndim != 2 or len(before) > before.size:
        raise ArgumentError("v_minus", before.shape, "shape (n, d), or (d,) of one impact, d > 0")
    n, d = before.shape
    vectors = [np.atleast_2d(_finite(name, given)) for name, given in others.items()]
    for name, each in zip(others, vectors, strict=True):
        if each.shape != (n, d):
            raise ArgumentError(name, each.shape, f"shape {before.shape}, as v_minus")
    if masses.shape not in ((1, d, d), (n, d, d)):
        raise ArgumentError("mass_matrix", masses.shape, f"shape ({d}, {d}) or ({n}, {d}, {d})")
    return [masses, before, *vectors]


class Judged(NamedTuple):
    """The exact answers `gained` (n,), and the numbers of impacts that integers decided and
    confirmed."""

    gained: Booleans
    by_integers: int
    checked: int


def judge_gains(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> Judged:
    """Return for each of n impacts whether it gained kinetic energy, from M (d, d) or (n, d, d), v⁻
    and v⁺ (n, d).

    Raises
    ------
    IapbError
        The bound and the integers disagree, so this program or the processor has a fault.
    """
    return _judged(*_impacts(mass_matrix, v_minus, v_plus=v_plus))


def _judged(masses: Floats, before: Floats, after: Floats) -> Judged:
    signs = np.empty(len(before), np.int64)
    gain_signs(masses, before, after, signs)
    gained = signs > 0
    unsure = np.flatnonzero(signs == 0)
    checked = np.flatnonzero(signs)[::_CHECKED]
    for k in (*unsure, *checked):
        gains = exact_gain(masses[k % len(masses)], before[k], after[k]) > 0
        if signs[k] and gains != gained[k]:
            raise IapbError(
                f"impact {k}: an error of iapb: the exact energy is outside its double-double bounds"
            )
        gained[k] = gains
    return Judged(gained, len(unsure), len(checked))


def certify(run: Run) -> Certificate:
    """Judge the energy of every impact of a run exactly, and check impulses, velocities and
    contacts for consistency.

    The engine's kernels compute M again from the recorded q; they give the same bits on every
    x86-64 processor. The digest in the record is that of M computed in this way after the run, not
    of the M inside the step. If the digests agree, then q, scene and kernels are those of the
    recording. The recorded generalized impulse must equal M(v⁺ − v⁻) within `MOMENTUM_TOLERANCE`;
    this shows that M is the mass matrix of the impact.

    Parameters
    ----------
    run : a run of the engine, simulated or read from its file

    Returns
    -------
    Certificate

    Raises
    ------
    ArgumentError
        The record holds a number that is not finite, or steps that the run does not have.
    IapbError
        The digest of the recomputed M differs from the recorded one.
    """
    _refuse_places(run)
    silent = run.law not in ENGINE_LAWS and not any(
        piece.contacts.impulse.any() for piece in _pieces(run)
    )  # another world may not record impulses of contacts
    residuals = [(_total(piece), *_contacts(piece, silent)) for piece in _pieces(run)]
    total, span, restitution = np.fmax.reduce(residuals).tolist()
    # else some depend on others
    every_row = bool(np.all(run.impacts.rank[:] >= run.impacts.rows[:]))
    judged = run.law == ImpulseAugmented().name and every_row and not np.isnan(restitution)
    return replace(
        _certificate(_batches(run)),
        span=span,
        restitution=restitution,
        total=total,
        restitution_judged=judged,
    )


def _refuse_places(run: Run) -> None:
    """Raise ArgumentError unless each impact and each contact is at a step of the run, in order."""
    steps = len(run.impulse)
    step = run.impacts.step[:]
    if len(step) and not (step.min() >= 0 and step.max() < steps):
        raise ArgumentError("impacts.step", step.max(), f"steps from 0 to {steps - 1}")
    if (np.diff(step) < 0).any():
        raise ArgumentError("impacts.step", step, "steps that never fall")
    offsets = run.contacts.offsets[:]
    rows = len(run.contacts.impulse)
    fits = len(offsets) == steps + 1 and offsets[0] >= 0 and offsets[-1] <= rows
    if not fits or (np.diff(offsets) < 0).any():
        expected = f"{steps + 1} numbers of rows, from 0 to {rows}, that never fall"
        raise ArgumentError("contacts.offsets", offsets, expected)


class _Piece(NamedTuple):
    """What is certified of some successive steps of a run, in memory; offsets and steps of impacts
    count from the first of them."""

    run: Run
    impulse: Floats
    contacts: ContactTable
    impacts: ImpactTable


def _pieces(run: Run) -> Iterator[_Piece]:
    """Yield a run in pieces of limited memory; its arrays may be in a file."""
    steps, d = run.impulse.shape
    size = d + len(run.contacts.impulse) // max(steps, 1)  # of a step
    few = max(_PIECE // max(size, 1), 1)
    step = run.impacts.step[:]
    for first in range(0, max(steps, 1), few):
        impulse = run.impulse[first : first + few]
        last = first + len(impulse)
        offsets = run.contacts.offsets[first : last + 1]
        begin, end = np.searchsorted(step, (first, last))
        contacts = _read(
            run.contacts,
            ("body_a", "body_b", "point", "normal", "impulse"),
            slice(offsets[0], offsets[-1]),
        )
        impacts = _read(
            run.impacts,
            ("q", "v_minus", "v_plus", "impulse", "rows", "scale"),
            slice(begin, end),
        )
        yield _Piece(
            run,
            impulse,
            replace(contacts, offsets=offsets - offsets[0]),
            replace(impacts, step=step[begin:end] - first),
        )


def _read(table: Table, names: Sequence[str], rows: slice) -> Table:
    """Return a table with these rows of these columns in memory."""
    return replace(table, **{name: getattr(table, name)[rows] for name in names})


def _total(piece: _Piece) -> float:
    """Return `Certificate.total` of a piece, whose numbers must be finite."""
    (_, impulse, contacts, table) = piece
    sums = -impulse
    size = np.abs(impulse)
    for name in ("q", "v_minus", "v_plus", "impulse", "scale"):
        _finite(f"impacts.{name}", getattr(table, name))
    for name in ("impulse", "normal", "point"):
        _finite(f"contacts.{name}", getattr(contacts, name)[contacts.impulse != 0.0])
    _finite("impulse", impulse)
    np.add.at(sums, table.step, table.impulse)
    np.add.at(size, table.step, np.abs(table.impulse))
    return _largest_share(np.abs(sums).sum(axis=1), size.sum(axis=1))


def _batches(run: Run) -> Iterator[Batch]:
    """Yield M, v⁻, v⁺ and the generalized impulse of the recorded impacts in batches of
    `_BATCH`."""
    scene = scene_from_values(run.scene_resolved)
    table = run.impacts
    mechanism = mechanism_of(scene)
    begin = start_of(scene)[0]
    for start in range(0, len(table.step), _BATCH):
        chosen = slice(start, start + _BATCH)
        masses = mechanism.mass_matrices_of_run(begin, table.q[chosen])
        other = np.flatnonzero(digests(masses) != table.mass_digest[chosen])
        if len(other):
            raise IapbError(
                f"impact {start + other[0]}: M computed again from q differs from the "
                "recorded M; the record was changed, or another version of iapb wrote it"
            )
        yield masses, table.v_minus[chosen], table.v_plus[chosen], table.impulse[chosen]


def exported_run(run: Run) -> Iterator[str]:
    """Yield the impacts of a run as the lines of `exported`."""
    for mass_matrix, v_minus, v_plus, _ in _batches(run):
        yield from exported(mass_matrix, v_minus, v_plus)


def exported(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> Iterator[str]:
    """Yield each impact as a line of integers, for a checker that shares no code with this module.

    A line holds d, then a mantissa and an exponent of two for each entry of M (row by row), of v⁻
    and of v⁺. Nothing is rounded. A complete file starts with `EXPORT_HEAD` and ends with "end" and
    the number of impacts. The arguments are those of `judge_gains`, for n impacts.
    """
    masses, before, after = _impacts(mass_matrix, v_minus, v_plus=v_plus)
    masses = np.broadcast_to(masses, (len(before), *masses.shape[1:]))
    for mass, *velocities in zip(masses, before, after, strict=True):
        mantissas, exponents = np.frexp(np.concatenate((mass.ravel(), *velocities)))
        pairs = np.stack(((mantissas * 2.0**53).astype(np.int64), exponents - 53), axis=1)
        yield " ".join(map(str, (len(mass), *pairs.ravel().tolist())))


def certify_impacts(
    mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike, impulse: ArrayLike | None = None
) -> Certificate:
    """Judge n impacts of any engine exactly.

    Parameters
    ----------
    mass_matrix : M as the impacts used it, (d, d) for all or (n, d, d)
    v_minus, v_plus : velocities before and after, (n, d), or (d,) of one impact
    impulse : recorded M(v⁺ − v⁻), (n, d), if it is known

    Returns
    -------
    Certificate

    Raises
    ------
    ArgumentError
        A shape does not fit, a number is not finite or complex, or an M is indefinite.
    """
    given = {"v_plus": v_plus} | ({} if impulse is None else {"impulse": impulse})
    masses, *vectors = _impacts(mass_matrix, v_minus, **given)

    def batches() -> Iterator[Batch]:
        for start in range(0, len(vectors[0]), _BATCH):
            chosen = slice(start, start + _BATCH)
            few = masses if len(masses) == 1 else masses[chosen]
            _refuse_indefinite(few, start)
            before, after, *recorded = (each[chosen] for each in vectors)
            yield few, before, after, recorded[0] if recorded else None

    return _certificate(batches())


def _refuse_indefinite(masses: Floats, start: int) -> None:
    scaled = masses / np.maximum(
        np.abs(masses).max(axis=(1, 2), keepdims=True, initial=0.0), 1e-300
    )
    values = np.linalg.eigvalsh(0.5 * scaled + 0.5 * scaled.transpose(0, 2, 1))
    wrong = np.flatnonzero(
        values.min(axis=1, initial=0.0) < -_INDEFINITE * np.abs(values).max(axis=1, initial=0.0)
    )
    if len(wrong):
        raise ArgumentError(
            f"mass_matrix of impact {start + wrong[0]}",
            masses[wrong[0]].tolist(),
            "a matrix without negative eigenvalues",
        )


def _certificate(batches: Iterable[Batch]) -> Certificate:
    """Judge impacts in batches of M, v⁻, v⁺ and impulse."""
    impacts = 0
    first_gain = -1
    counterexample = ""
    momentum = np.nan
    gains: list[float] = []
    decided: list[Judged] = []
    for masses, before, after, recorded in batches:
        judged = _judged(masses, before, after)
        for k in np.flatnonzero(judged.gained).tolist():
            one = masses[k % len(masses)], before[k], after[k]
            gains.append(relative_energy_gain(*one))
            if first_gain < 0:
                first_gain = impacts + k
                counterexample = _shown(*one)
        decided.append(judged)
        impacts += len(before)
        if recorded is not None and len(before):
            momentum = float(np.fmax(momentum, _momentum(masses, before, after, recorded)))
    return Certificate(
        impacts,
        len(gains),
        sum(one.by_integers for one in decided),
        sum(one.checked for one in decided),
        first_gain,
        max(gains, default=0.0),
        momentum,
        counterexample=counterexample,
    )


def _momentum(masses: Floats, before: Floats, after: Floats, recorded: Floats) -> float:
    """Return `Certificate.momentum` of a batch."""
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow fails the certificate
        change = after - before
        size = _form(np.abs(masses), np.abs(change)) + np.abs(recorded).sum(axis=1)
        missing = np.matmul(masses, change[:, :, None])[:, :, 0] - recorded
        # a weak impact changes a fast body by few units in the last place
        rounded = _EPSILON * _form(np.abs(masses), np.abs(after) * (change != 0.0))
        error = np.maximum(np.abs(missing).sum(axis=1) - rounded, 0.0)
    return _largest_share(error, size)


def _form(masses: Floats, vectors: Floats) -> Floats:
    """Return the sum of the entries of M x for each of n vectors x."""
    total: Floats = np.matmul(masses, vectors[:, :, None]).sum(axis=(1, 2))
    return total


def _largest_share(error: Floats, size: Floats) -> float:
    """Return the largest error / size: 0 / 0 counts as 0, an overflow as infinity; NaN is kept for
    "not judged"."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(error == 0.0, 0.0, error / size)
    return float(np.where(np.isnan(share), np.inf, share).max(initial=0.0))


def _shown(mass: Floats, before: Floats, after: Floats) -> str:
    """Return Python source that computes the energy gain with rationals alone."""
    return f"""from fractions import Fraction
M = {mass.tolist()!r}
v_minus = {before.tolist()!r}
v_plus = {after.tolist()!r}
def twice_energy(v):
    v = [Fraction(x) for x in v]
    return sum(Fraction(m) * v[i] * v[j] for i, row in enumerate(M) for j, m in enumerate(row))
print(twice_energy(v_plus) - twice_energy(v_minus))  # above 0: the impact gained energy
"""


class _Struck(NamedTuple):
    """The k steps whose impacts happened at one moment: that at which their contacts are recorded.

    first, last : (k,) the first and the last impact of each step
    whole : (k,) whether restitution is asked of v⁺: no impact was scaled, and none moved a
        coordinate that another one moves again
    """

    steps: Integers
    first: Integers
    last: Integers
    whole: NDArray[np.bool_]


def _struck_at_once(impacts: ImpactTable, poisson: bool) -> _Struck:
    """Return the steps that are judged; by Poisson's law, those of a single contact."""
    _, first, line = np.unique(impacts.step, return_index=True, return_inverse=True)
    moved = np.bincount(line, (impacts.q != impacts.q[first[line]]).any(axis=1)) > 0.0
    chosen = np.flatnonzero(~moved[line])
    step = impacts.step[chosen]
    steps, first, line = np.unique(step, return_index=True, return_inverse=True)
    last = len(line) - 1 - np.unique(step[::-1], return_index=True)[1]
    times_moved = np.zeros((len(steps), impacts.v_plus.shape[1]))
    np.add.at(times_moved, line, (impacts.v_plus != impacts.v_minus)[chosen])
    spoilt = impacts.scale[chosen] != 1.0
    if poisson:
        spoilt |= impacts.rows[chosen] > 1
    whole = (np.bincount(line, spoilt) == 0.0) & (times_moved <= 1.0).all(axis=1)
    return _Struck(steps, chosen[first], chosen[last], whole)


def _contacts(piece: _Piece, silent: bool) -> tuple[float, float]:
    """Return `Certificate.span` and `Certificate.restitution` of a piece; NaN for one that it cannot
    decide."""
    (run, impulse, table, impacts) = piece
    scene = scene_from_values(run.scene_resolved)
    rubbing = run.law_settings.get("friction_in_impacts") and scene.largest_friction > 0
    steps, first, last, whole = _struck_at_once(impacts, scene.contact.forces == "implicit")
    per_body = scene.contact.self_collision_rows == "per_body"
    if silent or rubbing or per_body or not len(steps):
        return np.nan, np.nan
    mechanism = mechanism_of(scene)
    step_of = np.repeat(np.arange(len(impulse)), np.diff(table.offsets))
    m = np.flatnonzero((table.impulse != 0.0) & np.isin(step_of, steps))
    k = np.searchsorted(steps, step_of[m])
    rows_a, rows_b = (
        mechanism.rows_along(impacts.q[first[k]], body[m], table.point[m], table.normal[m])
        for body in (table.body_a, table.body_b)
    )
    rows = rows_a - rows_b  # (11), (12): nᵀ(J_a − J_b)
    pushed = rows * table.impulse[m][:, None]
    difference = -impulse[steps]
    size = np.abs(impulse[steps])
    np.add.at(difference, k, pushed)
    np.add.at(size, k, np.abs(pushed))
    span = _largest_share(np.abs(difference).sum(axis=1), size.sum(axis=1))
    restitutions = system_of(scene).restitutions
    if len(restitutions) > 1 or run.law_settings.get("pushing") or not whole.any():
        return span, np.nan
    before = rows * impacts.v_minus[first[k]]
    after = rows * impacts.v_plus[last[k]]
    off = np.abs(after.sum(axis=1) + float(restitutions[0]) * before.sum(axis=1))
    felt = np.abs(before).sum(axis=1)
    return span, _largest_share(off[whole[k]], felt[whole[k]])
