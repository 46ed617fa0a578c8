"""Textbook resolvers whose contacts only push, and resolvers with one planted bug each, by the law
that detects it.

The report shows one fault per law of equalities (`verification.laws.planted`).
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from reference.complementarity import ImpactProblem, solve
from reference.complementarity.laws import poisson as poisson_of
from reference.exact import exact_impact
from verification.impacts import Floats
from verification.laws.resolver import Resolver
from verification.methods import sound_resolver

TOO_MUCH = Fraction(10001, 10000)  # factor on the impulse that e requires
Impulses = tuple[Floats, Floats]


def reversed_velocity(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Keeps energy and restitution but ignores the contacts."""
    return -e * v


def returns_too_much(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Gives 1e-4 more of the impulse than e requires; rationals, rounded once, give the same bits
    under every BLAS."""
    before = [Fraction(x) for x in v.tolist()]
    exact = exact_impact(M, J, v, e).velocity
    return np.array([float(a + TOO_MUCH * (b - a)) for a, b in zip(before, exact, strict=True)])


def makes_stale_jacobian() -> Resolver:
    """Returns a resolver that reuses the Jacobian of the first call with each shape."""
    remembered: dict[tuple[int, ...], Floats] = {}
    return lambda M, J, v, e: sound_resolver(M, remembered.setdefault(J.shape, J), v, e)


# Contacts that only push.
def newton(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Newton's law 0 ≤ p ⟂ γ⁺ + e γ⁻ ≥ 0 (Moreau 1988), by active sets."""
    problem = ImpactProblem.from_impact(M, J, v, e)
    return solve(problem, "daqp").velocity_plus if len(J) else v


def poisson(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Poisson's law 0 ≤ p_c ⟂ γ_c ≥ 0, then 0 ≤ p − (1 + e) p_c ⟂ γ⁺ ≥ 0 (Anitescu and Potra
    1997)."""
    return poisson_of(ImpactProblem.from_impact(M, J, v, e)).velocity if len(J) else v


def _adhesive(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Also stops contacts that separate."""
    return sound_resolver(M, J[J @ newton(M, J, v, e) > 0.0], newton(M, J, v, e), 0.0)


def _one_sweep(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Resolves each contact once, in order, so later contacts undo earlier ones."""
    for row in J:
        v = newton(M, row[None], v, e)
    return v


# Friction: Moreau's law. The plastic impact obeys Coulomb's law; e scales its whole impulse by 1 +
# e. This is passive.
def _plastic(M: Floats, J: Floats, T: Floats, v: Floats, mu: Floats, e: float = 0.0) -> Impulses:
    """Normal and tangential impulses (c,), (c, m) of Coulomb's law with Newton's e, by sweeps over
    the contacts."""
    c = len(J)
    m = T.shape[1]
    if not c:
        return np.zeros(0), np.zeros((0, m))
    rows = np.concatenate([J[:, None], T], axis=1).reshape(-1, len(v))
    problem = ImpactProblem.from_impact(M, rows, v, e, mu, contact_size=1 + m)
    p = solve(problem, "nsgs").answer().reshape(c, 1 + m)
    return p[:, 0], p[:, 1:]


def _struck(M: Floats, J: Floats, T: Floats, v: Floats, p: Floats, p_t: Floats) -> Floats:
    return v + np.linalg.solve(M, J.T @ p + np.einsum("cm,cmd->d", p_t, T))


def moreau(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Moreau (1988): (v⁺ + e v⁻)/(1 + e) obeys Coulomb's law with e = 0; passive for every e in [0,
    1]."""
    p, p_t = _plastic(M, J, T, v, mu)
    return _struck(M, J, T, v, (1.0 + e) * p, (1.0 + e) * p_t)


def _newton_and_coulomb(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Newton's e on the normals and Coulomb's friction: may gain energy (Kane and Levinson
    1985)."""
    return _struck(M, J, T, v, *_plastic(M, J, T, v, mu, e))


def _friction_pushes(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Friction pushes in the direction of sliding, not against it."""
    p, p_t = _plastic(M, J, T, v, mu)
    return _struck(M, J, T, v, (1.0 + e) * p, -(1.0 + e) * p_t)


def no_friction(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    return moreau(M, J, T, v, e, 0.0 * mu)


def _strikes_what_separates(
    M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats
) -> Floats:
    """The convex relaxation (Anitescu and Tasora 2010) at e = 0: a sliding contact separates with
    velocity μ|v_t|."""
    if not len(J):
        return v
    rows = np.concatenate([J[:, None], T], axis=1).reshape(-1, len(v))
    problem = ImpactProblem.from_impact(
        M, rows, v, 0.0, mu, contact_size=1 + T.shape[1], relaxed=True
    )
    return v + (1.0 + e) * (solve(problem, "nsgs").velocity_plus - v)


def _weak_friction(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Halves the friction of sliding contacts: this stays inside the cone and is passive, but
    breaks Coulomb's law."""
    p, p_t = _plastic(M, J, T, v, mu)
    share = np.where(np.linalg.norm(p_t, axis=1) < mu * p * (1.0 - 1e-9), 1.0, 0.5)
    return _struck(M, J, T, v, (1.0 + e) * p, (1.0 + e) * share[:, None] * p_t)


def _makes_stale_friction() -> Callable[..., Floats]:
    """Returns a resolver that knows an impact by all but μ."""
    known: dict[Any, Floats] = {}

    def stale(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
        key = *(array.tobytes() for array in (M, J, T, v)), e
        if key not in known:
            known[key] = moreau(M, J, T, v, e, mu)
        return known[key]

    return stale


# contract and name -> the law that must detect it, and the resolver
PUSHING: dict[tuple[str, str], tuple[str, Callable[..., Any]]] = {
    ("unilateral", "wrong sign"): (
        "kinetic_energy",
        lambda M, J, v, e: 2.0 * v - newton(M, J, v, e),
    ),
    ("unilateral", "pulls"): ("pushing", sound_resolver),
    ("unilateral", "adhesive"): ("separating", _adhesive),
    ("unilateral", "squared restitution"): (
        "restitution",
        lambda M, J, v, e: newton(M, J, v, e * e),
    ),
    # contacts separate too fast, but no inequality is broken and energy need not rise
    ("unilateral", "too bouncy"): (
        "complementarity",
        lambda M, J, v, e: newton(M, J, v, float(np.sqrt(e))),
    ),
    ("unilateral", "one sweep"): ("no_penetration", _one_sweep),
    ("unilateral", "plastic where some separate"): (
        "mixed_restitution",
        lambda M, J, v, e: newton(M, J, v, 0.0 if np.any(J @ v > 0.0) else e),
    ),
    ("frictional", "Newton and Coulomb"): ("kinetic_energy", _newton_and_coulomb),
    ("frictional", "friction pushes"): ("friction_opposes", _friction_pushes),
    ("frictional", "twice the friction"): (
        "cone",
        lambda M, J, T, v, e, mu: moreau(M, J, T, v, e, 2.0 * mu),
    ),
    ("frictional", "no friction"): ("sticking", no_friction),
    ("frictional", "squared restitution"): (
        "restitution",
        lambda M, J, T, v, e, mu: moreau(M, J, T, v, e * e, mu),
    ),
    ("frictional", "strikes what separates"): ("separating", _strikes_what_separates),
    ("frictional", "weak friction"): ("maximal_dissipation", _weak_friction),
    ("frictional", "stale friction"): ("new_friction", _makes_stale_friction()),
}
