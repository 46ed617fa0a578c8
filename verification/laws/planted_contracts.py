"""Textbook resolvers whose contacts only push, without and with friction, and variants with one planted bug each."""

from __future__ import annotations

import numpy as np

from reference.complementarity import ImpactProblem, solve
from verification.impacts import Floats
from verification.laws.planted import PlantedBug, plain
from verification.laws.resolver import back, least_push, sound_resolver, whitened


def _pushing(M: Floats, J: Floats, v: Floats, factor: float) -> Floats:
    parts = whitened(M, J, v)
    return back(parts, parts.u + factor * (parts.rows.T @ least_push(parts.rows, -parts.u)))


def newton(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Newton's law 0 ≤ p ⟂ γ⁺ + e γ⁻ ≥ 0 (Moreau 1988), where p/(1 + e) = q minimizes |u + Aᵀq|."""
    return _pushing(M, J, v, 1.0 + e)


def poisson(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Poisson's law 0 ≤ p_c ⟂ γ_c ≥ 0, then 0 ≤ p − (1 + e) p_c ⟂ γ⁺ ≥ 0 (Anitescu and Potra 1997)."""
    return _pushing(M, J, newton(M, J, v, e), 1.0)


def _squared_restitution(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return newton(M, J, v, e * e)


def _too_bouncy(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Uses √e instead of e: contacts separate too fast, but no inequality is broken and energy need not rise."""
    return newton(M, J, v, float(np.sqrt(e)))


def _wrong_sign(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return _pushing(M, J, v, -(1.0 + e))


def _adhesive(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Also stops contacts that separate."""
    return sound_resolver(M, J[J @ newton(M, J, v, e) > 0.0], newton(M, J, v, e), 0.0)


def _one_sweep(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Resolves each contact once, in order, so later contacts undo earlier ones."""
    for row in J:
        v = newton(M, row[None], v, e)
    return v


def _forgotten_mass(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return newton(np.eye(len(v)), J, v, e)


def _slow_contacts_ignored(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Ignores contacts that approach more slowly than 0.01 m/s."""
    return newton(M, J[J @ v < -0.01], v, e)


def _plastic_where_some_separate(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Uses e = 0 if some contacts separate."""
    return newton(M, J, v, 0.0 if np.any(J @ v > 0.0) else e)


# Friction: Moreau's law. The plastic impact obeys Coulomb's law; e scales its whole impulse by 1 + e. This is passive.
def _plastic(M: Floats, J: Floats, T: Floats, v: Floats, mu: Floats, e: float = 0.0) -> tuple[Floats, Floats]:
    """Normal and tangential impulses (c,), (c, m) of Coulomb's law with Newton's e, by sweeps over the contacts."""
    c, m = len(J), T.shape[1]
    if not c:
        return np.zeros(0), np.zeros((0, m))
    rows = np.concatenate([J[:, None], T], axis=1).reshape(-1, len(v))
    problem = ImpactProblem.from_impact(M, rows, v, e, mu, contact_size=1 + m)
    p = solve(problem, "nsgs").answer().reshape(c, 1 + m)
    return p[:, 0], p[:, 1:]


def _struck(M: Floats, J: Floats, T: Floats, v: Floats, p: Floats, p_t: Floats) -> Floats:
    return v + np.linalg.solve(M, J.T @ p + np.einsum("cm,cmd->d", p_t, T))


def moreau(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Moreau (1988): (v⁺ + e v⁻)/(1 + e) obeys Coulomb's law with e = 0; passive for every e in [0, 1]."""
    p, p_t = _plastic(M, J, T, v, mu)
    return _struck(M, J, T, v, (1.0 + e) * p, (1.0 + e) * p_t)


def _newton_and_coulomb(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Newton's e on the normals and Coulomb's friction: may gain energy (Kane and Levinson 1985)."""
    return _struck(M, J, T, v, *_plastic(M, J, T, v, mu, e))


def _friction_pushes(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Friction pushes in the direction of sliding, not against it."""
    p, p_t = _plastic(M, J, T, v, mu)
    return _struck(M, J, T, v, (1.0 + e) * p, -(1.0 + e) * p_t)


def _twice_the_friction(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    return moreau(M, J, T, v, e, 2.0 * mu)


def _no_friction(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    return moreau(M, J, T, v, e, 0.0 * mu)


def _less_friction_returned(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    return moreau(M, J, T, v, e * e, mu)


def _pulls(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Treats every normal row as an equality and has no friction."""
    return sound_resolver(M, J, v, e)


def _strikes_what_separates(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """The convex relaxation (Anitescu and Tasora 2010) at e = 0: a sliding contact separates with velocity μ|v_t|."""
    if not len(J):
        return v
    rows = np.concatenate([J[:, None], T], axis=1).reshape(-1, len(v))
    problem = ImpactProblem.from_impact(M, rows, v, 0.0, mu, contact_size=1 + T.shape[1], relaxed=True)
    return v + (1.0 + e) * (solve(problem, "nsgs").velocity_plus - v)


def _weak_friction(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Halves the friction of sliding contacts: this stays inside the cone and is passive, but breaks Coulomb's law."""
    p, p_t = _plastic(M, J, T, v, mu)
    limit = mu * p * (1.0 - 1e-9)
    share = np.where(np.linalg.norm(p_t, axis=1) < limit, 1.0, 0.5)
    return _struck(M, J, T, v, (1.0 + e) * p, (1.0 + e) * share[:, None] * p_t)


def _friction_of_one_alone(M: Floats, J: Floats, T: Floats, v: Floats, e: float, mu: Floats) -> Floats:
    """Drops friction if there is more than one contact."""
    return moreau(M, J, T, v, e, mu if len(J) == 1 else 0.0 * mu)


SOUND = {"unilateral": (newton, poisson), "frictional": (moreau,)}

PLANTED: dict[str, dict[str, PlantedBug]] = {
    "unilateral": {
        "wrong_sign": plain(_wrong_sign, "kinetic_energy"),
        "forgotten_mass": plain(_forgotten_mass, "kinetic_energy"),
        "pulls": plain(sound_resolver, "pushing"),
        "adhesive": plain(_adhesive, "separating"),
        "squared_restitution": plain(_squared_restitution, "restitution"),
        "too_bouncy": plain(_too_bouncy, "complementarity"),
        "one_sweep": plain(_one_sweep, "no_penetration"),
        "plastic_where_some_separate": plain(_plastic_where_some_separate, "mixed_restitution"),
        "slow_contacts_ignored": plain(_slow_contacts_ignored, "restitution"),
    },
    "frictional": {
        "newton_and_coulomb": plain(_newton_and_coulomb, "kinetic_energy"),
        "friction_pushes": plain(_friction_pushes, "friction_opposes"),
        "twice_the_friction": plain(_twice_the_friction, "cone"),
        "no_friction": plain(_no_friction, "sticking"),
        "squared_restitution": plain(_less_friction_returned, "restitution"),
        "pulls": plain(_pulls, "cone"),
        "strikes_what_separates": plain(_strikes_what_separates, "separating"),
        "weak_friction": plain(_weak_friction, "maximal_dissipation"),
        "friction_of_one_alone": plain(_friction_of_one_alone, "maximal_dissipation"),
    },
}
