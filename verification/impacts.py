"""ImpactCase, the type of one impact, and all generators of impacts. The same seed always gives the
same impacts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference.complementarity import ImpactProblem
from reference.exact import exact_impact, exact_rank

Floats = NDArray[np.floating[Any]]
EPS = float(np.finfo(float).eps)


def over(value: Floats, scale: Floats) -> Floats:
    """value / scale; where the scale is 0, a value above 0 gives infinity, any other 0."""
    return np.divide(value, scale, out=np.where(value > 0.0, np.inf, 0.0), where=scale > 0.0)


# Singular values of the unit-scaled rows of A in this gap are neither clearly rounding nor clearly
# motion. A correct resolver may treat them as either, so laws that compare velocities skip such
# impacts.
ROUNDING_BELOW = 1e-13
MOTION_ABOVE = 1e-5
RANK_CUT = 1e-9  # anywhere in the gap
INDEPENDENT = 1e-7  # ten times the motion that a resolver may leave in rows that it drops


@dataclass(frozen=True)
class ImpactCase:
    """One impact: M (d, d), J (c, d), v (d,), scalar e, and known properties of them.

    Attributes
    ----------
    family : name of the generator's family.
    translations : (k, d) motions z with J z = 0 exactly.
    unequal : (c,) restitutions, each in [0, 1], that replace e.
    touching : (k, d) rows of contacts that touch and do not approach.
    tangents, friction : (c, m, d) rows of m tangents per contact, and (c,) Coulomb's μ; give both
        or neither.
    rank : the first `rank` rows are independent; the others depend on them.
    """

    mass_matrix: Floats
    contact_jacobian: Floats
    velocity: Floats
    restitution: float = 0.0
    family: str = ""
    translations: Floats | None = None
    unequal: Floats | None = None
    touching: Floats | None = None
    tangents: Floats | None = None
    friction: Floats | None = None
    rank: int | None = None

    @property
    def arrays(self) -> tuple[Any, Any, Any]:
        """M, J and v."""
        return self.mass_matrix, self.contact_jacobian, self.velocity

    @property
    def coordinates(self) -> int:
        """Number of coordinates d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """Number of contacts c."""
        return len(self.contact_jacobian)

    @property
    def mu(self) -> Any:
        """Coulomb's μ (c,); 0 without friction."""
        return np.zeros(self.contacts) if self.friction is None else self.friction

    @property
    def redundancy(self) -> int:
        """Number of rows beyond the rank of J."""
        return (
            self.contacts - int(np.linalg.matrix_rank(self.contact_jacobian))
            if self.contacts
            else 0
        )

    @cached_property
    def truth(self) -> tuple[Fraction, ...]:
        """Exact v⁺ for these doubles."""
        return exact_impact(*self.arrays, self.restitution).velocity

    def given_restitution(self) -> Any:
        """The restitution that a resolver gets: the scalar e, or a copy of the unequal ones."""
        return self.restitution if self.unequal is None else self.unequal.copy()

    def given(self) -> tuple[Any, ...]:
        """Copies of the arguments for a resolver: M, J, v and e; with friction M, J, T, v, e and
        μ."""
        M, J, v = (array.copy() for array in self.arrays)
        e = self.given_restitution()
        if self.tangents is None or self.friction is None:
            return M, J, v, e
        return M, J, self.tangents.copy(), v, e, self.friction.copy()

    @cached_property
    def condition(self) -> float:
        """κ(M)."""
        values = np.linalg.eigvalsh(self.mass_matrix)
        return float(values[-1] / values[0]) if values[0] > 0.0 else np.inf

    @cached_property
    def lower(self) -> Floats:
        """L with M = L Lᵀ."""
        return np.linalg.cholesky(self.mass_matrix)

    @cached_property
    def u(self) -> Floats:
        """Lᵀv (d,)."""
        return self.lower.T @ self.velocity

    @cached_property
    def rows(self) -> Floats:
        """A = J L⁻ᵀ (c, d)."""
        return np.linalg.solve(self.lower, self.contact_jacobian.T).T

    @cached_property
    def unit_rows(self) -> Floats:
        """Rows of A scaled to unit length; zero rows stay zero."""
        length = np.linalg.norm(self.rows, axis=1, keepdims=True)
        return np.divide(self.rows, length, out=np.zeros_like(self.rows), where=length > 0.0)

    @cached_property
    def with_tangents(self) -> ImpactCase:
        """The case with normals and tangents as its rows, not meant for resolvers; without friction
        the case itself."""
        if self.tangents is None:
            return self
        rows = np.vstack([self.contact_jacobian, self.tangents.reshape(-1, self.coordinates)])
        return ImpactCase(self.mass_matrix, rows, self.velocity)

    @cached_property
    def _svd(self) -> tuple[Floats, Floats]:
        _, values, right = np.linalg.svd(self.unit_rows, full_matrices=False)
        return values, right

    @cached_property
    def is_separated(self) -> bool:
        """Whether the rank is certain.

        No singular value of the unit rows lies between rounding and motion, and rows that are
        dependent up to rounding are dependent exactly. A resolver in exact arithmetic takes the
        others as independent.
        """
        values = self._svd[0]
        rank = len(self.row_space)
        if np.any((values > ROUNDING_BELOW) & (values < MOTION_ABOVE)):
            return False
        return rank == len(values) or rank == exact_rank(self.contact_jacobian)

    @cached_property
    def is_independent(self) -> bool:
        """Whether each row differs from every combination of the others by more than any resolver
        may neglect."""
        return self.contacts <= self.coordinates and bool(np.all(self._svd[0] > INDEPENDENT))

    @cached_property
    def row_space(self) -> Floats:
        """Orthonormal basis (rank, d) of the row space of A."""
        values, right = self._svd
        return right[values > RANK_CUT]

    @cached_property
    def smallest_motion(self) -> float:
        """Smallest singular value of the unit rows that counts as motion; 1 without rows."""
        values = self._svd[0]
        return float(np.min(values[values > RANK_CUT], initial=1.0))

    @cached_property
    def smallest_value(self) -> float:
        """Smallest singular value of the unit rows; 0 if there are more rows than coordinates."""
        if self.contacts > self.coordinates:
            return 0.0
        return float(np.min(self._svd[0], initial=1.0))

    @cached_property
    def largest_noise(self) -> float:
        """Largest singular value of the unit rows that counts as rounding; 0 if there is none."""
        values = self._svd[0]
        return float(np.max(values[values <= ROUNDING_BELOW], initial=0.0))

    @cached_property
    def speed(self) -> float:
        """Kinetic norm |u| = √(vᵀMv)."""
        return float(np.linalg.norm(self.u))

    def distance(self, one: Floats, other: Floats) -> float:
        """Distance between two velocities in the kinetic metric, relative to |u|."""
        length = float(np.linalg.norm(self.lower.T @ (one - other)))
        return length / self.speed if self.speed > 0.0 else (0.0 if length == 0.0 else np.inf)

    def unmet_restitution(self, v_plus: Floats) -> float:
        """max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|); zero rows give 0, and a system at rest must stay at
        rest."""
        unmet = np.abs(
            self.contact_jacobian @ v_plus
            + self.restitution * (self.contact_jacobian @ self.velocity)
        )
        return float(
            np.max(over(unmet, np.linalg.norm(self.rows, axis=1) * self.speed), initial=0.0)
        )

    @cached_property
    def _answers(self) -> dict[int, Any]:
        """Answers of resolvers for this case, by id(resolver). Each entry holds the resolver, so
        the id stays valid."""
        return {}


# Random impacts of many kinds, as the kit draws them.
MASS_KINDS = ("spectral", "graded", "arrow", "diagonal", "identity")
# Nearly dependent rows are listed three times, because most bugs of rank and conditioning show
# there.
_NEAR = ("nearly dependent",) * 3
ROW_KINDS = (
    "generic",
    "kinetic",
    "dependent",
    "scaled",
    "copies",
    "zeros",
    "none",
    "cradle",
    *_NEAR,
)
VELOCITY_KINDS = ("normal", "kinetic normal", "light direction", "grazing", "unseen")
RESTITUTIONS = (-1.0, 0.0, 0.5, 1.0, 1.0)
# W = J M⁻¹ Jᵀ of rows this close has singular values down to closeness²: an inverse of W errs by ε
# / closeness², 1e-6 to 1e-3, and numpy's cutoff of 1e-15 keeps them. Half of the errors are gains,
# whichever BLAS rounds.
ADVERSE = 24
ADVERSE_CLOSENESS = (5.0, 6.5)


# Sizes and units that ordinary draws never reach. Every LARGE_EVERY-th impact is large and takes
# these kinds in turn: many contacts on few coordinates, many coordinates, and rarely both, because
# that is slow.
LARGE_EVERY = 10
LARGE_KINDS = ("contacts", "coordinates", "contacts", "coordinates", "contacts and coordinates")
LARGE_COORDINATES = (11, 40)
LARGE_CONTACTS = (101, 500)
# Powers of two about ±8 decades: scaling by them is exact, so dependent rows stay dependent.
SCALE_POWERS = 27


def draw_wide_case(
    rng: np.random.Generator, number: int, largest_condition: float = 1e8
) -> ImpactCase:
    """Return impact `number` of a series. One in ten is large, half use other units, some are at
    rest or partly so."""
    large = number % LARGE_EVERY == LARGE_EVERY // 2
    kind = LARGE_KINDS[number // LARGE_EVERY % len(LARGE_KINDS)] if large else ""
    contacts = int(rng.integers(*LARGE_CONTACTS, endpoint=True)) if "contacts" in kind else None
    size = int(rng.integers(*LARGE_COORDINATES, endpoint=True)) if "coordinates" in kind else None
    case = draw_case(rng, largest_condition, coordinates=size, contacts=contacts)
    name = case.family
    v = case.velocity
    chance = rng.random()
    if chance < 0.15:
        name += ", at rest" if chance < 0.02 else ", partly at rest"
        v = v * ((chance >= 0.02) & (rng.random(len(v)) < 0.5))
    if rng.random() < 0.5:
        return replace(case, velocity=v, family=name)
    m, j, s = np.ldexp(1.0, rng.integers(-SCALE_POWERS, SCALE_POWERS + 1, size=3))
    name += f", times M {m:.0e} J {j:.0e} v {s:.0e}"
    return replace(
        case,
        mass_matrix=m * case.mass_matrix,
        contact_jacobian=j * case.contact_jacobian,
        velocity=s * v,
        family=name,
    )


def draw_case(
    rng: np.random.Generator,
    largest_condition: float = 1e8,
    coordinates: int | None = None,
    contacts: int | None = None,
    row_kinds: tuple[str, ...] = ROW_KINDS,
) -> ImpactCase:
    """Return one random impact with κ(M) up to `largest_condition`; by default d ≤ 10 and c ≤ 2 d +
    1."""
    rows_kind = _one_of(rng, row_kinds)
    d = int(rng.integers(1, 11)) if coordinates is None else coordinates
    condition = 10.0 ** rng.uniform(0.0, np.log10(largest_condition))
    mass_kind = "diagonal" if rows_kind == "cradle" else _one_of(rng, MASS_KINDS)
    mass = draw_mass_matrix(rng, mass_kind, d, condition)
    rows, closeness = draw_rows(rng, rows_kind, mass, contacts)
    velocity_kind = _one_of(rng, VELOCITY_KINDS)
    v = draw_velocity(rng, velocity_kind, mass, rows)
    e = float(rng.uniform(-1.0, 1.0)) if rng.random() < 0.4 else float(rng.choice(RESTITUTIONS))
    translations = np.ones((1, d)) if rows_kind == "cradle" else None
    name = f"{mass_kind} mass, {rows_kind} rows{closeness}, {velocity_kind} velocity"
    return ImpactCase(mass, rows, v, e, name, translations)


def adverse_cases(rng: np.random.Generator) -> Iterator[ImpactCase]:
    """Yield elastic impacts for which a formula with the inverse of W gains energy under every
    BLAS.

    The generator does not use BLAS, so a seed gives the same bits on every processor.
    """
    for k in range(ADVERSE):
        d = 2 + k % 3
        closeness = 10.0 ** -rng.uniform(*ADVERSE_CLOSENESS)
        rows = rng.normal(size=d) + closeness * rng.normal(size=(d, d))
        mass = np.diag(rng.uniform(0.1, 1.0, size=d))
        yield ImpactCase(
            mass, rows, rng.normal(size=d), 1.0, f"diagonal mass, {d} rows within {closeness:.0e}"
        )


def _one_of(rng: np.random.Generator, kinds: tuple[str, ...]) -> str:
    """Return a random kind, like `rng.choice` but without making an array of the kinds."""
    return kinds[int(rng.integers(0, len(kinds)))]


def with_unequal_restitution(rng: np.random.Generator, case: ImpactCase) -> ImpactCase:
    """Return the case with a restitution per row: either 0 and 1 at random, or uniform in [0,
    1]."""
    extremes = rng.random() < 0.5
    e = (
        rng.choice([0.0, 1.0], size=case.contacts)
        if extremes
        else rng.uniform(0.0, 1.0, size=case.contacts)
    )
    return replace(case, family=case.family + ", unequal e", unequal=e)


def with_spectrum(rng: np.random.Generator, spectrum: Floats) -> Floats:
    """Return M (…, d, d) with these eigenvalues (…, d) and random axes."""
    axes = np.linalg.qr(rng.normal(size=(*spectrum.shape, spectrum.shape[-1])))[0]
    mass = (axes * spectrum[..., None, :]) @ np.swapaxes(axes, -1, -2)
    return np.asarray(0.5 * (mass + np.swapaxes(mass, -1, -2)))


def draw_mass_matrix(rng: np.random.Generator, kind: str, d: int, condition: float) -> Floats:
    """Return a symmetric positive definite M (d, d) whose κ is of the order of `condition`."""
    spectrum = condition ** -np.sort(rng.uniform(0.0, 1.0, size=d))
    spectrum[0] = 1.0
    spectrum[-1] = 1.0 / condition if d > 1 else 1.0
    if kind == "identity":
        return np.eye(d)
    if kind == "diagonal":
        return np.diag(rng.permutation(spectrum))
    if kind == "graded":  # a well conditioned matrix in different units per coordinate
        s = np.sqrt(rng.permutation(spectrum))
        inner = draw_mass_matrix(rng, "spectral", d, 10.0)
        return s[:, None] * inner * s
    if kind == "arrow":  # one body coupled to many
        mass = np.diag(spectrum)
        mass[0, 1:] = mass[1:, 0] = (
            0.9 * np.sqrt(spectrum[1:] / d) * rng.choice([-1.0, 1.0], size=d - 1)
        )
        return mass
    return with_spectrum(rng, spectrum)


def draw_rows(
    rng: np.random.Generator, kind: str, mass: Floats, contacts: int | None = None
) -> tuple[Floats, str]:
    """Return J (c, d) of the kind, and a label that says how close to dependent its rows are (""
    for most kinds)."""
    d = len(mass)
    c = int(rng.integers(1, 2 * d + 2)) if contacts is None else contacts
    generic = rng.normal(size=(c, d))
    generic /= np.linalg.norm(generic, axis=1, keepdims=True)
    rank = int(rng.integers(1, min(c, d) + 1))
    if kind == "none":
        return np.zeros((0, d)), ""
    if kind == "kinetic":  # random in the kinetic metric, so that light and heavy directions mix
        return generic @ np.linalg.cholesky(mass).T, ""
    if kind == "dependent":
        return rng.integers(-2, 3, size=(c, rank)) @ in_few_bits(generic[:rank]), ""
    if kind == "nearly dependent":
        closeness = 10.0 ** -rng.uniform(*((3.0, 9.0) if rng.random() < 0.5 else (1.0, 16.0)))
        return generic[rng.integers(0, rank, size=c)] + closeness * generic, f" ({closeness:.0e})"
    if kind == "scaled":
        return 10.0 ** rng.uniform(-8.0, 8.0, size=(c, 1)) * generic, ""
    if kind == "copies":
        return np.tile(in_few_bits(generic[:rank]), (int(rng.integers(2, 6)), 1)), ""
    if kind == "opposed":  # a body between two walls
        half = in_few_bits(generic[: (c + 1) // 2])
        return np.vstack([half, -half])[:c], ""
    if kind == "zeros":
        return generic * (rng.random((c, 1)) < 0.5), ""
    if kind == "cradle":
        return cradle_rows(d), ""
    return generic, ""


def in_few_bits(numbers: Floats) -> Floats:
    """Return the numbers rounded to multiples of 2⁻²⁰: sums and products of a few are exact, so
    rows made of them are dependent exactly."""
    return np.asarray(np.ldexp(np.round(np.ldexp(numbers, 20)), -20))


def cradle_rows(d: int) -> Floats:
    """Return the rows (d − 1, d) of d bodies in a line, each in contact with the next: entries +1
    and −1."""
    return np.eye(d)[: d - 1] - np.eye(d, k=1)[: d - 1]


def draw_velocity(rng: np.random.Generator, kind: str, mass: Floats, rows: Floats) -> Floats:
    """Return v (d,) of the kind.

    The kinds are: v normally distributed, Lᵀv normally distributed, v along M's lightest direction,
    and v with rows @ v nearly or exactly zero.
    """
    d = len(mass)
    v = rng.normal(size=d)
    lower = np.linalg.cholesky(mass)
    if kind == "kinetic normal":
        return np.linalg.solve(lower.T, v)
    if kind == "light direction":
        return np.linalg.eigh(mass)[1][:, 0]
    if kind in ("grazing", "unseen") and len(rows):
        right = np.linalg.svd(rows, full_matrices=len(rows) < d)[2]
        unseen = right[min(len(rows), d - 1) :]
        along = unseen.T @ (unseen @ v)
        return along + (1e-9 * v if kind == "grazing" else 0.0)
    return v


# Impacts for unilateral contacts and for friction. A textbook method uses W = J M⁻¹ Jᵀ, which
# squares the closeness of rows, so nearly dependent rows are left out. Exact copies and sums of
# rows, as for a face on a floor, are included.
ONE_SIDED_ROW_KINDS = (
    "generic",
    "kinetic",
    "dependent",
    "copies",
    "opposed",
    "zeros",
    "none",
    "cradle",
)
ONE_SIDED_COORDINATES = 6
ONE_SIDED_CONTACTS = 6
ONE_SIDED_POWERS = 10  # powers of two in M and v, about ±3 decades: they reveal absolute thresholds
SIGNS = ("approaching", "approaching", "mixed")
SWEEPS = 2000  # a tenth of the sweeps that the solver of the reference takes
FRICTIONAL_KINDS = (
    "body in the plane",
    "two bodies in the plane",
    "body in space",
    "generic",
    "rod in the plane",
)


def draw_one_sided_case(
    rng: np.random.Generator, number: int, largest_condition: float = 1e4
) -> ImpactCase:
    """Return an impact of unilateral contacts, e in [0, 1]; in two of three impacts every contact
    approaches."""
    d = int(rng.integers(1, ONE_SIDED_COORDINATES + 1))
    c = int(rng.integers(1, ONE_SIDED_CONTACTS + 1))
    if rng.random() < 0.2:
        case = _standing_box(rng, c)
    else:
        case = draw_case(
            rng, largest_condition, coordinates=d, contacts=c, row_kinds=ONE_SIDED_ROW_KINDS
        )
    return _signed(rng, replace(case, restitution=_push_restitution(rng)))


def draw_frictional_case(
    rng: np.random.Generator, number: int, largest_condition: float = 1e2
) -> ImpactCase:
    """Return an impact with tangents and μ in [0, 2] that plain sweeps solve: bodies, and generic
    rows.

    Sweeps over the contacts converge slowly if a normal is nearly parallel to its tangents, or to
    another normal. About one draw in 60 needs more than SWEEPS; it is drawn again.
    """
    from reference.complementarity.solvers.sweeps import settles  # brings numba

    kind = FRICTIONAL_KINDS[number % len(FRICTIONAL_KINDS)]
    while True:
        mass, rows, translations = _frictional_rows(rng, kind, largest_condition)
        friction = rng.choice([0.0, 0.3, 1.0, float(rng.uniform(0.0, 2.0))], size=len(rows))
        velocity = draw_velocity(rng, _one_of(rng, ("normal", "kinetic normal")), mass, rows[:, 0])
        drawn = ImpactCase(
            mass,
            rows[:, 0],
            velocity,
            _push_restitution(rng),
            f"{kind}, {len(rows)} contacts with friction",
            translations,
            tangents=rows[:, 1:],
            friction=friction,
        )
        case = _signed(rng, drawn)
        blocks = np.concatenate([case.contact_jacobian[:, None], rows[:, 1:]], axis=1)
        problem = ImpactProblem.from_impact(
            case.mass_matrix,
            blocks.reshape(-1, case.coordinates),
            case.velocity,
            0.0,
            friction,
            contact_size=blocks.shape[1],
        )
        if settles(problem, SWEEPS):
            return case


def _push_restitution(rng: np.random.Generator) -> float:
    return float(rng.choice([0.0, 0.0, 0.5, 1.0, float(rng.uniform(0.0, 1.0))]))


def _standing_box(rng: np.random.Generator, contacts: int) -> ImpactCase:
    """Return a planar body whose face touches the floor at several points: at most two rows are
    independent."""
    rows = np.column_stack(
        [np.zeros(contacts), np.ones(contacts), rng.uniform(-0.5, 0.5, size=contacts)]
    )
    mass = np.diag([1.0, 1.0, float(rng.uniform(0.02, 1.0))])
    return ImpactCase(
        mass, rows, rng.normal(size=3), 0.0, f"a face on the floor at {contacts} points"
    )


def _signed(rng: np.random.Generator, case: ImpactCase) -> ImpactCase:
    """Return the case, perhaps in other units of M and v; the normals either all approach or stay
    as drawn."""
    signs = _one_of(rng, SIGNS)
    rows = case.contact_jacobian
    if signs == "approaching":
        rows = np.where((rows @ case.velocity > 0.0)[:, None], -rows, rows)
    m, s = np.ldexp(
        1.0, rng.integers(-ONE_SIDED_POWERS, ONE_SIDED_POWERS + 1, size=2) * (rng.random() < 0.5)
    )
    return replace(
        case,
        mass_matrix=m * case.mass_matrix,
        contact_jacobian=rows,
        velocity=s * case.velocity,
        family=f"{case.family}, {signs}",
    )


def _frictional_rows(
    rng: np.random.Generator, kind: str, largest_condition: float
) -> tuple[Floats, Floats, Floats | None]:
    """Return M, rows (c, 1 + m, d) of normals and tangents, and the translations: generic rows, or
    those of one or two rigid bodies."""
    if kind == "generic":
        d = int(rng.integers(2, ONE_SIDED_COORDINATES + 1))
        c = int(rng.integers(1, 4))
        m = int(rng.integers(1, min(3, d)))
        mass_kind = _one_of(rng, MASS_KINDS)
        condition = 10.0 ** rng.uniform(0.0, np.log10(largest_condition))
        mass = draw_mass_matrix(rng, mass_kind, d, condition)
        drawn = rng.normal(size=(c, 1 + m, d))
        return mass, drawn / np.linalg.norm(drawn, axis=2, keepdims=True), None
    inertia = 10.0 ** rng.uniform(-1.0, 0.0, size=6)  # arms are up to 0.7 m
    count = int(rng.integers(1, 4))
    if kind == "body in space":
        axes = in_few_bits(np.linalg.qr(rng.normal(size=(count, 3, 3)))[0])
        arms = in_few_bits(rng.uniform(-0.5, 0.5, size=(count, 3)))
        return np.diag([1.0, 1.0, 1.0, *inertia[:3]]), _rows_at(axes, arms), None
    angles = rng.uniform(0.0, 2.0 * np.pi, size=count)
    turned = angles[:, None] + [0.5 * np.pi, 0.0]  # of normals and tangents
    axes = np.stack([np.cos(turned), np.sin(turned), 0.0 * turned], axis=2)
    arms = np.pad(rng.uniform(-0.5, 0.5, size=(2, count, 2)), ((0, 0), (0, 0), (0, 1)))
    one, other = (_rows_at(axes, arm)[:, :, [0, 1, 5]] for arm in arms)
    if kind != "two bodies in the plane":  # steep friction can jam a rod
        turning = inertia[0] * (0.1 if kind == "rod in the plane" else 1.0)
        return np.diag([1.0, 1.0, turning]), one, None
    heavier = 10.0 ** rng.uniform(-1.0, 1.0)
    mass = np.diag([1.0, 1.0, inertia[0], heavier, heavier, heavier * inertia[1]])
    return mass, np.concatenate([one, -other], axis=2), np.tile(np.eye(2, 3), 2)


def _rows_at(axes: Floats, arms: Floats) -> Floats:
    """Return the rows (c, k, 6) of forces along k axes (c, k, 3) that act at arms (c, 3)."""
    return np.concatenate([axes, np.cross(arms[:, None], axes)], axis=2)


# Impacts for the algebraic claims: mass matrices of given condition, rows of given rank. Rows are
# small integers, and redundant rows are integer combinations of independent ones. Rank and
# redundancy are therefore exact in doubles, and the same impact can be solved in rationals.
WHOLE = 5  # entries of rows lie in -5..5


class Family(NamedTuple):
    """Properties that all impacts of a batch share."""

    coordinates: int
    contacts: int
    rank: int
    condition_number: float


def draw_of_rank(family: Family, count: int, seed: int) -> Iterator[ImpactCase]:
    """Yield `count` impacts; the same seed gives the same ones."""
    rng = np.random.default_rng([seed, *(round(number) for number in family)])
    half = 0.5 * np.log10(family.condition_number)
    spectrum = (
        10.0 ** np.linspace(-half, half, family.coordinates)
        if family.coordinates > 1
        else np.ones(1)
    )
    for _ in range(count):
        mass = with_spectrum(rng, spectrum)
        velocity = rng.standard_normal(family.coordinates)
        yield ImpactCase(mass, _rows_of_rank(rng, family), velocity, rank=family.rank)


def approaching(case: ImpactCase) -> ImpactCase:
    """Return the case with the sign of its first row chosen so that this contact approaches."""
    jacobian = case.contact_jacobian.copy()
    if jacobian[0] @ case.velocity > 0.0:
        jacobian[0] *= -1.0
    return replace(case, contact_jacobian=jacobian)


def integer_impacts(family: Family, count: int, seed: int) -> Iterator[ImpactCase]:
    """Yield impacts of integers (as doubles) with M = B Bᵀ + I, so that exact rationals stay
    short."""
    rng = np.random.default_rng([seed, *(round(number) for number in family), 1])
    d = family.coordinates
    for _ in range(count):
        factor = rng.integers(-3, 4, (d, d)).astype(np.float64)
        velocity = rng.integers(-9, 10, d).astype(np.float64)
        velocity[0] += not velocity.any()
        yield ImpactCase(
            factor @ factor.T + np.eye(d), _rows_of_rank(rng, family), velocity, rank=family.rank
        )


def _rows_of_rank(rng: np.random.Generator, family: Family) -> Floats:
    """Return integer rows (c, d) of exact rank `family.rank`; the first `rank` of them are
    independent."""
    rank = family.rank
    spare = family.contacts - family.rank
    while True:
        basis = rng.integers(-WHOLE, WHOLE + 1, (rank, family.coordinates)).astype(np.float64)
        if np.linalg.matrix_rank(basis) == rank:
            break
    mixing = rng.integers(-2, 3, (spare, rank)).astype(np.float64)
    return np.vstack([basis, mixing @ basis])


# Impacts for which equalities and complementarity have the same exact answer, so that both errors
# can be measured. The velocity is u⁻ = −Aᵀw + z with w > 0 and A z = 0. Then p = (1 + e) w pushes
# at every contact, so the equality law (21) and Newton's LCP have the same v⁺ (up to the rounding
# of v⁻ in nearly dependent directions).
TIMED_HARDNESS = tuple(product((1e0, 1e3, 1e6), (1.0, 1e-3, 1e-6)))


def timed_problem(contacts: int, coordinates: int, number: int, seed: int = 0) -> ImpactCase:
    """Return one of nine impacts of a size: three condition numbers of M times three closenesses of
    the rows.

    The restitution takes the values 0, 1/2 and 1 in turn.
    """
    condition, closeness = TIMED_HARDNESS[number]
    e = (0.0, 0.5, 1.0)[(number + number // 3) % 3]
    d = coordinates
    c = contacts
    rng = np.random.default_rng([seed, d, c, int(np.log10(condition)), int(-np.log10(closeness))])
    mass = with_spectrum(rng, condition ** -np.linspace(0.0, 1.0, d))
    name = f"d={d} c={c} κ(M)={condition:.0e} rows {closeness:.0e} apart"
    case = ImpactCase(mass, _near_rows(rng, d, c, closeness), np.zeros(d), e, name)
    approach = -case.unit_rows.T @ rng.uniform(0.2, 1.0, size=c)
    sliding = rng.normal(size=d)
    sliding -= case.row_space.T @ (case.row_space @ sliding)
    sliding /= max(float(np.linalg.norm(sliding)), 1.0)
    v = np.linalg.solve(case.lower.T, approach / float(np.linalg.norm(approach)) + sliding)
    return replace(case, velocity=v)


def _near_rows(rng: np.random.Generator, d: int, c: int, closeness: float) -> Floats:
    """Return rows (c, d) whose second half copies the first half up to the relative distance
    `closeness`.

    For c > d the rows span at most two thirds of the d dimensions.
    """
    rank = min(c, (2 * d) // 3)
    base = rng.integers(-4, 5, size=(c, rank)) @ rng.integers(-4, 5, size=(rank, d)).astype(float)
    if c <= d:
        base = rng.normal(size=(c, d))
    if closeness < 1.0:
        half = c // 2
        copied = base[: c - half]
        base[half:] = copied + closeness * np.linalg.norm(copied, axis=1)[:, None] * rng.normal(
            size=(c - half, d)
        )
    return base


# Many impacts of one size, for compiled resolvers: families in which rounding gains most, an
# ordinary one, and rows of any rank in any metric. Three quarters of the impacts are elastic.
ADVERSE_FAMILIES = (
    "ordinary",
    "light directions",
    "nearly dependent rows",
    "M asymmetric in the last bit",
    "subnormal velocities",
    "600 decades",
)
ANY_RANK = "any rank"
_DECADES = {
    "light directions": 12.0,
    "nearly dependent rows": 6.0,
    "M asymmetric in the last bit": 12.0,
    ANY_RANK: 12.0,
}


class Impacts(NamedTuple):
    """n impacts of one size."""

    mass: Floats  # (n, d, d)
    columns: Floats  # (n, d, c) Jᵀ
    v: Floats  # (n, d)
    restitution: Floats  # (n,)
    condition: Floats  # (n,) κ(M) as drawn


def draw_impacts(rng: np.random.Generator, family: str, n: int, d: int, c: int) -> Impacts:
    """Return n impacts of a family; κ(M) is log-uniform up to 10³, 10⁶ or 10¹²."""
    power = rng.uniform(0.0, _DECADES.get(family, 3.0), n) * (d > 1)
    mass: Floats = with_spectrum(rng, 10.0 ** (-power[:, None] * np.linspace(0.0, 1.0, d)))
    e = np.where(rng.random(n) < 0.75, 1.0, rng.uniform(-1.0, 1.0, n))
    columns: Floats = rng.normal(size=(n, d, c))
    v: Floats = rng.normal(size=(n, d))
    if family in (
        "light directions",
        "M asymmetric in the last bit",
    ):  # rows random in the kinetic metric
        values, axes = np.linalg.eigh(mass)
        columns = (axes * np.sqrt(np.abs(values))[:, None, :]) @ columns
        v = axes[:, :, 0]
    if family == "nearly dependent rows":
        columns = columns[:, :, :1] + 10.0 ** -rng.uniform(3.0, 14.0, (n, 1, 1)) * columns
    if family == "M asymmetric in the last bit":
        moved = np.nextafter(mass, np.where(rng.random((n, d, d)) < 0.5, np.inf, -np.inf))
        mass = np.where(np.triu(np.ones((d, d), bool), 1), moved, mass)
    if (
        family == "subnormal velocities"
    ):  # small integers times a power of two between 2⁻¹⁰⁷⁴ and 2⁻¹⁰⁵¹
        v = (
            np.rint(4.0 * v)
            * np.ldexp(1.0, rng.integers(-1074, -1050, n).astype(np.int32))[:, None]
        )
    if family == "600 decades":  # the energy fits a double, some products do not
        unit = 10.0 ** rng.uniform(-75.0, 75.0, (n, d))
        speed = 10.0 ** rng.uniform(-75.0, 75.0, (n, 1))
        mass = (
            mass
            * unit[:, :, None]
            * unit[:, None, :]
            * 10.0 ** rng.uniform(-120.0, 120.0, (n, 1, 1))
        )
        columns = columns * unit[:, :, None]
        v = v / unit * speed
    if family == ANY_RANK:
        columns, v = _of_any_rank(rng, mass, columns, v)
    return Impacts(*(np.ascontiguousarray(array) for array in (mass, columns, v, e, 10.0**power)))


def _of_any_rank(
    rng: np.random.Generator, mass: Floats, columns: Floats, v: Floats
) -> tuple[Floats, Floats]:
    """Return generic, dependent, copied or nearly dependent rows, and each of rows and v in the
    kinetic metric or not."""
    (n, d, c) = columns.shape
    kind = rng.integers(4)
    lower = np.linalg.cholesky(mass)
    rank = int(rng.integers(1, min(max(c, 1), d) + 1))
    basis = rng.normal(size=(n, d, rank))
    near = 10.0 ** -rng.uniform(1.0, 16.0, (n, 1, 1))
    if kind == 1:
        columns = basis @ rng.normal(size=(n, rank, c))
    if kind > 1:
        columns = basis[:, :, rng.integers(0, rank, size=c)] + (kind == 3) * near * columns
    if rng.random() < 0.5:
        columns = lower @ columns
    if rng.random() < 0.5:
        v = np.linalg.solve(np.swapaxes(lower, 1, 2), v[:, :, None])[:, :, 0]
    return columns, v
