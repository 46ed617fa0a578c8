"""How the limits of friction in an impact settle, part by part, against dense numpy on a given normal impact."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from iapb import resolve_frictional_impact
from iapb.compiled import block
from iapb.contact.kernels.impact import make_impact_work
from iapb.contact.kernels.impact_friction import (
    AT_LIMIT,
    FIFTH,
    HALF,
    HALVED,
    MET,
    ROUNDS,
    SETTLED,
    STILL,
    STRIDE,
    SWEEPS,
    TRIMS,
    UNDAMPED,
    _least_norm_start,
    _move_normals,
    _settle,
    _start,
    _stride,
    _sweep_tangents,
    _trim,
    friction_change,
    friction_sweeps,
    make_friction_work,
    settle_friction,
)
from iapb.contact.kernels.unilateral import make_push_work

D, RANK = 7, 2
TANGENTS = pytest.mark.parametrize("size", [1, 2])


class Impact:
    """Normal rows A = diag(length) rowsᵀ of rank 2, their basis Q, Δ_n = Qᵀ target; tangents B ⟂ Q and A_t Qᵀ."""

    def __init__(self, size: int, seed: int, count: int = 3, pulls: bool = False, speed: float = 1.0,
                 coupling: float = 0.3) -> None:
        rng = np.random.default_rng(seed)
        work, f, push = make_impact_work(D, count + 1), make_friction_work(D, count + 1, size), make_push_work(D, count)
        self.work, self.f, self.push = block(work), block(f), block(push)
        self.size, self.count, self.rng = size, count, rng
        Q = np.linalg.qr(rng.normal(size=(D, RANK)))[0].T
        unit = rng.normal(size=(count, RANK)) + [2.0, 0.0]
        unit /= np.linalg.norm(unit, axis=1)[:, None]
        self.A = unit @ Q * rng.uniform(0.5, 2.0, (count, 1))
        self.work.rows[:, :count], self.work.length[:count] = (unit @ Q).T, np.linalg.norm(self.A, axis=1)
        self.work.basis[:RANK] = Q
        self.pushed = speed * rng.exponential(1.0, count) * (-1.0 if pulls else 1.0)
        self.work.change[:], self.work.u[:] = self.pushed @ self.A, speed * rng.normal(size=D)
        B = rng.normal(size=(count * size, D))
        self.B = B - B @ Q.T @ Q
        self.tied = coupling * rng.normal(size=(count * size, RANK))
        self.f.free[: count * size], self.f.normal_part[: count * size, :RANK] = self.B, self.tied
        self.f.slip[:], self.f.coefficient[:] = speed * rng.normal(size=len(f.slip)), rng.uniform(0.1, 0.8, count + 1)
        self.f.inertia[:count] = [np.linalg.eigvalsh(b @ b.T)[-1] for b in self.B.reshape(count, size, D)]
        for name in ("wanted", "without", "radius", "change", "sliding", "p", "response", "left", "moved", "target"):
            getattr(self.f, name)[:] = 7.0  # whatever an impact before left there
        self.normals, self.target = self.A @ Q.T, self.work.change @ Q.T  # B_n (c, r) and B_nᵀ p = target

    def start(self) -> bool:
        """Let the kernel begin: factors, responses, impulses without friction."""
        self.f.p[: self.count * self.size] = 0.0
        return bool(_start(self.count, RANK, self.work, self.push, self.f, D))

    def p(self) -> np.ndarray:
        return self.f.p[: self.count * self.size].copy()

    def lengths(self) -> np.ndarray:
        """|p_i|."""
        return np.linalg.norm(self.p().reshape(self.count, self.size), axis=1)

    def nearest(self, wanted: np.ndarray, p: np.ndarray) -> np.ndarray:
        """The normal impulses nearest to the wanted ones with B_nᵀ p_n + A_t Qᵀ p_t = Q Δ_n."""
        return wanted + np.linalg.pinv(self.normals.T) @ (self.target - self.tied.T @ p - self.normals.T @ wanted)

    def parts(self) -> tuple[Any, ...]:
        """The arguments of the parts."""
        return self.count, RANK, self.work, self.push, self.f


@TANGENTS
def test_impulses_without_friction_push_and_explain_the_normal_impact(size: int) -> None:
    for seed in range(8):
        at = Impact(size, seed, 4 if seed % 2 else 2 + seed % 4)
        count, f = at.count, at.f
        if seed % 2:
            at.A[0], at.normals[0], at.pushed[0] = 0.0, 0.0, 0.0  # a row that nothing moves by
            at.work.rows[:, 0], at.work.length[0] = 0.0, 0.0
            at.work.change[:] = at.pushed @ at.A
            at.target = at.work.change @ at.work.basis[:RANK].T
        assert at.start()
        without = f.without[:count]
        assert without.min() >= 0.0 and without @ at.A == pytest.approx(at.work.change, abs=1e-12)
        if seed % 2:
            assert without[0] == 0.0
        if count == 2 and seed % 2 == 0:
            assert without == pytest.approx(nnls(at.A.T, at.work.change)[0], abs=1e-12)
        assert f.wanted[:count] == pytest.approx(np.linalg.pinv(at.normals.T) @ at.target, abs=1e-12)  # spread
        assert f.target[:RANK] == pytest.approx(at.target, abs=1e-13)
        assert f.sliding[:count].tolist() == f.coefficient[:count].tolist() and not f.radius[:count].any()
        for j in range(count * size):
            loaded = np.linalg.pinv(at.normals.T) @ -at.tied[j]
            assert f.response[j] == pytest.approx(loaded[j // size], abs=1e-12)
        assert f.sliding[count] == f.radius[count] == f.wanted[count] == f.without[count] == 7.0  # another group's


@TANGENTS
def test_where_contacts_pull_the_least_norm_decides_who_carries_friction(size: int) -> None:
    signs: set[bool] = set()
    for seed in range(6):
        at = Impact(size, seed, pulls=True)
        at.work.change[:] += 3.0 * at.A[0]
        at.target = at.work.change @ at.work.basis[:RANK].T
        f, least = at.f, np.linalg.pinv(at.normals.T) @ at.target
        pushes = at.start()
        expected = nnls(at.A.T, at.work.change)[1] <= 1e-9 * np.linalg.norm(at.work.change)
        assert pushes == expected
        if pushes:
            f.p[:] = 3.0
            _least_norm_start(*at.parts())
            assert not at.p().any() and np.all(f.p[at.count * size :] == 3.0)
        assert f.without[:3] == pytest.approx(least, abs=1e-12)
        assert np.array_equal(f.wanted[:3], f.without[:3]) and not f.radius[:3].any()
        assert f.sliding[:3].tolist() == np.where(f.without[:3] > 0.0, f.coefficient[:3], 0.0).tolist()
        signs |= set((f.without[:3] > 0.0).tolist())
    assert signs == {True, False}


@TANGENTS
def test_an_impact_that_changes_nothing_leaves_no_impulse(size: int) -> None:
    at = Impact(size, 0)
    at.work.change[:] = 0.0
    assert at.start()
    assert not (at.f.without[:3].any() or at.f.wanted[:3].any() or at.f.target[:RANK].any())
    assert settle_friction(*at.parts(), D, 1.0)
    assert not at.p().any()


@TANGENTS
def test_normal_impulses_move_with_friction_to_the_nearest_or_to_those_of_least_norm(size: int) -> None:
    for seed in range(6):
        at = Impact(size, seed, 3 + seed % 2)
        at.start()
        n = at.count * size
        p = at.rng.normal(size=n) * (at.rng.random(n) < 0.7)
        wanted = at.rng.normal(size=at.count)
        at.f.p[:n], at.f.wanted[: at.count] = p, wanted
        told = _move_normals(*at.parts(), True)
        assert told == pytest.approx(np.linalg.norm(at.target - at.tied.T @ p - at.normals.T @ wanted), abs=1e-12)
        assert at.f.wanted[: at.count] == pytest.approx(at.nearest(wanted, p), abs=1e-12)
        assert _move_normals(*at.parts(), False) == 0.0
        assert at.f.wanted[: at.count] == pytest.approx(at.nearest(np.zeros(at.count), p), abs=1e-12)
        assert at.f.wanted[at.count] == 7.0 and np.array_equal(at.p(), p)


@TANGENTS
def test_a_limit_strides_by_newton_where_its_contact_slides(size: int) -> None:
    """1 / (1 − μ ∂p_n/∂p_t along p_t), ten at most; 1 where the contact sticks or carries nothing."""
    at, seen = Impact(size, 3), set()
    f = at.f
    for _ in range(60):
        f.p[:], f.response[:] = at.rng.normal(size=len(f.p)), 3.0 * at.rng.normal(size=len(f.p))
        f.sliding[:] = at.rng.uniform(0.0, 1.0, len(f.sliding))
        for i, length in enumerate(at.lengths()):
            own = slice(i * size, (i + 1) * size)
            gain = f.sliding[i] * f.response[own] @ f.p[own] / length
            for share, slides in ((0.5, True), (AT_LIMIT - 1e-9, False), (AT_LIMIT + 1e-9, True), (1.0, True)):
                f.radius[i] = length / share if share > 0.5 else 0.0
                expected = 1.0 / max(1.0 - gain, 1.0 / STRIDE) if slides else 1.0
                assert _stride(f, i, size) == pytest.approx(expected, rel=1e-12)
            seen.add(1.0 - gain < 1.0 / STRIDE)
    f.p[:size], f.radius[0] = 0.0, 0.0
    assert _stride(f, 0, size) == 1.0 and seen == {True, False}


def swept(at: Impact, radius: np.ndarray, p: np.ndarray, sweeps: int, still: float) -> tuple[np.ndarray, float]:
    """Impulses after some sweeps (which test_impact_friction.py states), and what they tell."""
    p, slip, inertia = p.copy(), at.f.slip[: at.count * at.size].copy(), at.f.inertia[: at.count].copy()
    told = friction_sweeps(at.B, slip, radius.copy(), inertia, p, np.zeros(D), np.zeros(at.size), sweeps, still)
    return p, float(told)


def round_of_sweeps(at: Impact, radius: np.ndarray, change: np.ndarray, p: np.ndarray, still: float) -> Any:
    """One sweep, more while it moves; what is told is the first sweep, or a held impulse whose limit moves."""
    p, told = swept(at, radius, p, 1, 0.0)
    if told > still:
        p, _ = swept(at, radius, p, SWEEPS - 1, SETTLED * told)
    lengths = np.linalg.norm(p.reshape(at.count, at.size), axis=1)
    held = lengths >= radius - STRIDE * np.abs(change)
    of_limits = at.f.inertia[: at.count] * np.minimum(np.abs(change), lengths) * held
    return p, max(told, float(of_limits.max()))


@TANGENTS
def test_a_round_sweeps_and_tells_what_moved_or_would_with_its_limit(size: int) -> None:
    by_limit = 0
    for seed in range(12):
        at, f = (found := Impact(size, seed)), found.f
        f.radius[:3], f.p[: 3 * size] = at.rng.exponential(0.5, 3), 0.3 * at.rng.normal(size=3 * size)
        f.change[:3] = at.rng.normal(size=3) * (10.0, 1.0, 0.01)[seed % 3]
        if seed % 2:  # where the sweeps are done, limits alone move
            f.p[: 3 * size] = swept(at, f.radius[:3], at.p(), 300, 1e-14)[0]
        for still in (0.0, 0.5, 1e9):
            first = at.p()
            p, expected = round_of_sweeps(at, f.radius[:3], f.change[:3], first, still)
            by_limit += expected > swept(at, f.radius[:3], first, 1, 0.0)[1]
            assert _sweep_tangents(f, 3, size, D, still) == pytest.approx(expected, rel=1e-9, abs=1e-13)
            assert at.p() == pytest.approx(p, abs=1e-13)
    assert by_limit > 5


def settled(at: Impact, scale: float, pushes: bool, p: np.ndarray, wanted: np.ndarray) -> Any:
    """The rounds in numpy: p_t, p_n, the limits, and whether the last round moved less than MET."""
    f, count, radius = at.f, at.count, at.f.radius[: at.count].copy()
    speed = float(np.linalg.norm(at.work.u))
    for done in range(ROUNDS):
        defect = float(np.linalg.norm(at.target - at.tied.T @ p - at.normals.T @ wanted)) if pushes else 0.0
        wanted = at.nearest(wanted if pushes else np.zeros(count), p)
        if pushes:
            wanted = np.maximum(wanted, 0.0)
        change = f.sliding[:count] * np.maximum(wanted, 0.0) - radius
        stride = np.ones(count)
        for i in range(count):
            own, length = slice(i * at.size, (i + 1) * at.size), np.linalg.norm(p[i * at.size : (i + 1) * at.size])
            if length > 0.0 and length >= AT_LIMIT * radius[i]:
                gain = f.sliding[i] * f.response[own] @ p[own] / length
                stride[i] = 1.0 / max(1.0 - gain, 1.0 / STRIDE)
        step = 1.0 if done < UNDAMPED else HALF if done < HALVED else FIFTH
        radius = np.maximum(0.0, radius + step * stride * change)
        p, moved = round_of_sweeps(at, radius, change, p, STILL * scale)
        moved = max(moved, scale * defect / speed if speed > 0.0 else 0.0)
        if moved <= STILL * scale:
            return p, wanted, radius, True, done
    return p, wanted, radius, moved <= MET * scale, ROUNDS


@TANGENTS
@pytest.mark.parametrize("speed", [1e-3, 1.0, 1e3])
def test_rounds_go_on_until_limits_normal_impulses_and_friction_agree(size: int, speed: float) -> None:
    for seed in range(4):
        at = Impact(size, seed, 4, speed=speed, coupling=0.1)
        pushes, count, f = at.start(), at.count, at.f
        assert pushes
        near = seed < 3
        if near:
            f.wanted[:count] = speed * at.rng.normal(size=count)  # far off: most of the rounds move these alone
        else:
            f.without[:count] = f.wanted[:count]
        scale = 3.0 * speed
        p, wanted, radius, met, _ = settled(at, scale, near, at.p(), f.wanted[:count].copy())
        assert _settle(*at.parts(), D, scale, near) == met
        assert at.p() == pytest.approx(p, abs=1e-12 * speed)
        assert f.wanted[:count] == pytest.approx(wanted, abs=1e-12 * speed)
        assert f.radius[:count] == pytest.approx(radius, abs=1e-12 * speed)
        assert met  # so Coulomb's law holds with the normal impulses that go with it
        assert wanted == pytest.approx(at.nearest(wanted, p), abs=1e-10 * speed)
        assert radius == pytest.approx(f.sliding[:count] * np.maximum(wanted, 0.0), abs=1e-10 * speed)


@TANGENTS
def test_normal_impulses_alone_settle_to_rounding_of_the_speed(size: int) -> None:
    """No slip and no friction: what is left to find are impulses that push and explain Δ_n, at any unit of speed."""
    for speed in (1e-6, 1.0, 1e6):
        at = Impact(size, 1, 4, speed=speed)
        assert at.start()
        at.f.slip[:], at.f.sliding[:] = 0.0, 0.0
        at.f.wanted[:4] = speed * np.array([-2.0, 3.0, 5.0, -1.0])
        assert _settle(*at.parts(), D, speed, True)
        left = at.target - at.normals.T @ at.f.wanted[:4]
        assert np.linalg.norm(left) <= 1e-11 * speed and at.f.wanted[:4].min() >= 0.0


@TANGENTS
def test_limits_that_do_not_agree_are_damped_and_given_up(size: int) -> None:
    """Friction that relieves what carries it, strongly: undamped, then by halves, then by fifths."""
    rounds = []
    for seed in range(4):
        at = Impact(size, seed, 3, coupling=3.0)
        at.f.coefficient[:] = 1.0
        at.start()
        p, wanted, radius, met, done = settled(at, 1.0, False, at.p(), at.f.wanted[:3].copy())
        assert _settle(*at.parts(), D, 1.0, False) == met
        rounds.append(done)
        assert at.p() == pytest.approx(p, rel=1e-6, abs=1e-6)
        assert at.f.radius[:3] == pytest.approx(radius, rel=1e-6, abs=1e-6)
    assert max(rounds) > UNDAMPED


@TANGENTS
@pytest.mark.parametrize("near", [False, True])
def test_what_is_trimmed_lies_within_its_cone_and_its_normal_impulses_follow(size: int, near: bool) -> None:
    for seed in range(6):
        at = Impact(size, seed, 4, coupling=0.02 if seed < 4 else 2.0)
        assert at.start()
        f, n = at.f, 4 * size
        f.p[:n] = at.rng.normal(size=n) * (0.1 if seed == 0 else 1.0)
        p, wanted = at.p(), f.wanted[:4].copy()
        for trims in range(TRIMS + 1):
            wanted = at.nearest(wanted if near else np.zeros(4), p)
            limit, length = f.sliding[:4] * np.maximum(wanted, 0.0), np.linalg.norm(p.reshape(4, size), axis=1)
            if trims == TRIMS or np.all(length <= limit):
                break
            p = (p.reshape(4, size) * np.minimum(1.0, limit / np.maximum(length, 1e-300))[:, None]).ravel()
        _trim(*at.parts(), near)
        assert at.p() == pytest.approx(p, abs=1e-12)
        assert f.wanted[:4] == pytest.approx(wanted, abs=1e-12)
        if seed < 4:
            assert np.all(at.lengths() <= f.sliding[:4] * np.maximum(f.wanted[:4], 0.0) * (1.0 + 1e-6))


@pytest.mark.parametrize("near", [False, True])
def test_only_what_is_negative_by_rounding_becomes_zero(near: bool) -> None:
    """Of the nearest impulses, to 1e-12 of the largest; what pulls by more, or by least norm, is told."""
    for below in (1e-14, 1e-9, 0.1):
        at = Impact(1, 0, 2, speed=0.0)
        at.start()
        at.f.target[:RANK] = at.normals.T @ [-3.0 * below, 3.0]
        at.f.p[:] = at.f.wanted[:2] = 0.0
        _trim(*at.parts(), near)
        assert at.f.wanted[1] == pytest.approx(3.0)
        if near and below == 1e-14:
            assert at.f.wanted[0] >= 0.0
        else:
            assert at.f.wanted[0] == pytest.approx(-3.0 * below, rel=0.3, abs=2e-14)


def breach(at: Impact, limit: np.ndarray) -> float:
    """By how much friction is not Coulomb's: no slip within the limit, against the slip on it."""
    p, w = at.p(), at.f.slip[: at.count * at.size] + at.B @ (at.B.T @ at.p())
    found = 0.0
    for i in range(at.count):
        own, slip = p[i * at.size : (i + 1) * at.size], w[i * at.size : (i + 1) * at.size]
        length = float(np.linalg.norm(own))
        assert length <= limit[i] + 1e-10
        on_it = length >= limit[i] * (1.0 - 1e-9)
        found = max(found, float(np.linalg.norm(slip * limit[i] + own * np.linalg.norm(slip)) if on_it
                                 else np.linalg.norm(slip)))  # fmt: skip
    return found


@TANGENTS
@pytest.mark.parametrize("pulls", [False, True])
def test_settled_friction_obeys_coulombs_law_with_its_own_normal_impulses(size: int, pulls: bool) -> None:
    for seed in range(6):
        at = Impact(size, seed, pulls=pulls)
        if pulls:
            at.work.change[:] += 3.0 * at.A[0]
            at.target = at.work.change @ at.work.basis[:RANK].T
        assert settle_friction(*at.parts(), D, 1.0)
        f = at.f
        limit = f.sliding[:3] * np.maximum(f.wanted[:3], 0.0)
        assert breach(at, limit) <= 1e-9
        assert f.wanted[:3] == pytest.approx(at.nearest(f.wanted[:3], at.p()), abs=1e-10)
        B = at.B.reshape(3, size, D)
        assert f.inertia[:3] == pytest.approx([np.linalg.eigvalsh(b @ b.T)[-1] for b in B])


@pytest.mark.parametrize(("size", "seed"), [(1, 14), (1, 21), (1, 35), (2, 1), (2, 2), (2, 4)])
def test_where_no_limits_agree_friction_dissipates_most_under_those_without_it(size: int, seed: int) -> None:
    at = Impact(size, seed, coupling=6.0)
    at.f.coefficient[:] = 2.0
    at.start()
    least = np.linalg.pinv(at.normals.T) @ at.target
    assert not settle_friction(*at.parts(), D, 1.0)
    assert at.f.without[:3] == pytest.approx(least, abs=1e-12)
    limit = 2.0 * np.maximum(least, 0.0)
    assert at.f.radius[:3] == pytest.approx(limit, abs=1e-12)
    assert breach(at, limit) <= 1e-6
    assert at.f.wanted[:3] == pytest.approx(at.nearest(np.zeros(3), at.p()), abs=1e-11)


@TANGENTS
def test_what_friction_adds_is_the_passive_share_of_its_impulses(size: int) -> None:
    """Δ ← Δ_n + α β Bᵀp_t: no energy more than the normal part left; all of it where Coulomb's law is met and slow."""
    kept = set()
    for seed in range(10):
        at = Impact(size, seed, coupling=0.2 if seed < 5 else 6.0)
        at.f.coefficient[:] = 0.5 if seed < 5 else 2.0
        normal, lower = at.work.change.copy(), np.eye(D)
        at.f.free[: 3 * size] = at.B + at.tied @ at.work.basis[:RANK]  # the tangents' rows A_t
        at.f.slip[:] = 7.0
        share, met = friction_change(lower, *at.parts(), D)
        change, u = at.work.change, at.work.u
        assert at.f.slip[: 3 * size] == pytest.approx((at.B + at.tied @ at.work.basis[:RANK]) @ (u + normal), abs=1e-11)
        assert 0.0 <= share <= 1.0
        assert change - normal == pytest.approx(share * at.p() @ at.B, abs=1e-11)
        before = max(u @ normal + 0.5 * normal @ normal, 0.0)
        assert u @ change + 0.5 * change @ change <= before + 1e-11
        kept.add((met, share == 1.0))
    assert (True, True) in kept and len(kept) > 1


@TANGENTS
def test_the_impulses_of_normals_and_friction_are_all_that_changes_the_momentum(size: int) -> None:
    """M (v⁺ − v) = Jᵀ p_n + Tᵀ p_t, within the cones, without a gain of energy."""
    shares = set()
    for seed in range(10):
        rng = np.random.default_rng(seed)
        d, c = 6, 2 + seed % 2
        root = rng.normal(size=(d, d))
        M, J, T = root @ root.T + 0.3 * np.eye(d), rng.normal(size=(c, d)), rng.normal(size=(c, size, d))
        v, mu = 3.0 * rng.normal(size=d), rng.uniform(0.2, 1.5, c)
        found = resolve_frictional_impact(M, J, T, v, float(seed % 3) / 2.0, mu)
        p_t = np.asarray(found.tangential_impulses)
        change = J.T @ found.impulses + np.einsum("imd,im->d", T, p_t)
        assert M @ (found.velocity - v) == pytest.approx(change, abs=1e-8)
        assert np.all(np.linalg.norm(p_t, axis=1) <= mu * np.maximum(found.impulses, 0.0) * (1.0 + 1e-9) + 1e-9)
        assert found.velocity @ M @ found.velocity <= v @ M @ v * (1.0 + 1e-12)
        assert J @ found.velocity == pytest.approx(-float(seed % 3) / 2.0 * J @ v, abs=1e-8)
        shares.add(found.friction_share == 1.0)
    assert True in shares
