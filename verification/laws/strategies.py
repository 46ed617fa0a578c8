"""Hypothesis strategies: impacts of small integers and powers of ten, which shrink to readable counterexamples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from reference.exact import independent_rows
from verification.impacts import Floats, ImpactCase, cradle_rows
from verification.laws.scenes import SceneCase, Values


@st.composite
def mass_matrices(draw: st.DrawFn, d: int, largest_exponent: int = 8) -> Floats:
    """M = T D Tᵀ with T unit triangular of small integers and D powers of ten; κ is up to about 10^largest_exponent."""
    powers = draw(st.lists(st.integers(-largest_exponent, 0), min_size=d, max_size=d))
    entries = draw(st.lists(st.integers(-1, 1), min_size=d * d, max_size=d * d))
    T = np.tril(np.reshape(entries, (d, d)).astype(float), -1) + np.eye(d)
    mass = T * 10.0 ** np.array(powers, dtype=float) @ T.T
    return 0.5 * (mass + mass.T)


@st.composite
def contact_jacobians(draw: st.DrawFn, d: int, largest: int = 5) -> Floats:
    """Rows of integers; some are close to the previous row, at a distance of a power of ten, and some are zero."""
    c = draw(st.integers(0, largest))
    rows = np.zeros((c, d))
    for i in range(c):
        rows[i] = draw(st.lists(st.integers(-3, 3), min_size=d, max_size=d))
        if i and draw(st.booleans()):  # close to the row before, at a distance from 0.1 to rounding
            rows[i] = rows[i - 1] + 10.0 ** -draw(st.integers(1, 16)) * rows[i]
    return rows


@st.composite
def velocities(draw: st.DrawFn, mass: Floats) -> Floats:
    """Small integers as v or as Lᵀv, or M's lightest direction as v."""
    d = len(mass)
    whole = np.array(draw(st.lists(st.integers(-3, 3), min_size=d, max_size=d)), dtype=float)
    kind = draw(st.sampled_from(["v", "u", "light"]))
    if kind == "u":
        return np.linalg.solve(np.linalg.cholesky(mass).T, whole)
    return np.linalg.eigh(mass)[1][:, 0] if kind == "light" else whole


def restitutions() -> st.SearchStrategy[float]:
    """e: one of 1, 0, −1 and 0.5, or any value in [−1, 1]."""
    return st.one_of(st.sampled_from([1.0, 0.0, -1.0, 0.5]), st.floats(-1.0, 1.0))


@st.composite
def unequal_cases(draw: st.DrawFn, largest_exponent: int = 8) -> ImpactCase:
    """An impact with a separate restitution for each row."""
    case = draw(impact_cases(largest_exponent))
    e = draw(st.lists(st.sampled_from([0.0, 1.0, 0.5]), min_size=case.contacts, max_size=case.contacts))
    return replace(case, unequal=np.array(e, dtype=float))


@st.composite
def impact_cases(draw: st.DrawFn, largest_exponent: int = 8, largest_size: int = 4) -> ImpactCase:
    """An impact with κ(M) up to about 10^largest_exponent."""
    d = draw(st.integers(1, largest_size))
    if draw(st.booleans()):
        masses = 10.0 ** np.array(draw(st.lists(st.integers(-4, 0), min_size=d, max_size=d)), dtype=float)
        mass: Floats = np.diag(masses)
        return ImpactCase(
            mass, cradle_rows(d), draw(velocities(mass)), draw(restitutions()), "cradle", np.ones((1, d))
        )
    mass, rows = draw(mass_matrices(d, largest_exponent)), draw(contact_jacobians(d))
    return ImpactCase(mass, rows, draw(velocities(mass)), draw(restitutions()), "whole numbers")


@st.composite
def one_sided_cases(draw: st.DrawFn) -> ImpactCase:
    """An impact whose contacts only push, e in [0, 1]; in half of the draws every contact approaches."""
    case = draw(impact_cases(largest_exponent=2))
    rows = case.contact_jacobian
    if draw(st.booleans()):
        rows = np.where((rows @ case.velocity > 0.0)[:, None], -rows, rows)
    return replace(case, contact_jacobian=rows, restitution=draw(st.sampled_from([1.0, 0.0, 0.5])))


@st.composite
def frictional_cases(draw: st.DrawFn) -> ImpactCase:
    """An impact as in `one_sided_cases` with one or two integer tangents per contact, and μ."""
    case = draw(one_sided_cases())
    shape = case.contacts, draw(st.integers(1, 2)), case.coordinates
    entries = draw(st.lists(st.integers(-2, 2), min_size=int(np.prod(shape)), max_size=int(np.prod(shape))))
    friction = draw(st.lists(st.sampled_from([1.0, 0.0, 0.5]), min_size=case.contacts, max_size=case.contacts))
    case = replace(case, tangents=np.reshape(entries, shape).astype(float), friction=np.array(friction, dtype=float),
                   translations=None)
    assume(tangents_are_independent(case))
    return case


def tangents_are_independent(case: ImpactCase) -> bool:
    """Whether the normal and the tangents of each contact are linearly independent; True without friction."""
    if case.tangents is None:
        return True
    blocks = np.concatenate([case.contact_jacobian[:, None], case.tangents], axis=1)
    return all(len(independent_rows(block)) == len(block) for block in blocks)


# Strategies for the search of counterexamples: one per contract, and one with a restitution per row.
SEARCHED = {"equality": impact_cases, "unequal": unequal_cases, "unilateral": one_sided_cases,
            "frictional": frictional_cases}


@st.composite
def scenes(draw: st.DrawFn, steps: int = 60) -> SceneCase:
    """A short scene of simple numbers: one or two discs, and sometimes a link, in a room; any law and rendering."""
    count, linked = draw(st.integers(1, 2)), draw(st.booleans())
    bodies = [draw(_discs(k)) for k in range(count)]
    if linked:
        angle, spin = draw(st.integers(-3, 3)), draw(st.integers(-9, 9))
        bodies.append({"name": "link", "joint": "revolute", "mass": 1.0, "inertia": 1e-3,
                       "center_of_mass": [0.05, 0.0], "position": [float(angle)], "velocity": [float(spin)],
                       "shapes": [{"kind": "box", "size": [0.1, 0.02], "center": [0.05, 0.0]}]})  # fmt: skip
    contact = {
        "forces": "paper",
        "stiffness": 10.0 ** draw(st.integers(1, 4)), "damping": float(draw(st.sampled_from([0, 1, 10]))),
        "restitution": draw(st.sampled_from([0.0, 0.5, 1.0])), "friction": draw(st.sampled_from([0.0, 0.3])),
    }  # fmt: skip
    walls = [{"name": "floor", "kind": "half_plane", "point": [0.0, -0.2], "normal": [0.0, 1.0]},
             {"name": "side", "kind": "half_plane", "point": [0.2, 0.0], "normal": [-1.0, 0.0]}]  # fmt: skip
    rate = float(draw(st.sampled_from([250, 1000])))
    values = {"name": "small_scene", "rate": rate, "duration": steps / rate, "bodies": bodies, "walls": walls,
              "integrator": "semi_implicit_euler", "contact": contact,
              "gravity": draw(st.sampled_from([None, [0.0, -10.0]]))}  # fmt: skip
    return SceneCase(values, draw(st.sampled_from(["IAPB", "PB"])))


@st.composite
def _discs(draw: st.DrawFn, k: int) -> Values:
    """A disc of 0.01 to 10 kg with a velocity of integers."""
    v = draw(st.lists(st.integers(-3, 3), min_size=3, max_size=3))
    return {"name": f"disc_{k}", "joint": "planar", "mass": 10.0 ** draw(st.integers(-2, 1)), "inertia": 1e-3,
            "shapes": [{"kind": "circle", "radius": 0.05}], "position": [0.1 * k, -0.1, 0.0],
            "velocity": [float(x) for x in v]}  # fmt: skip


@st.composite
def scenes_in_space(draw: st.DrawFn, steps: int = 60) -> SceneCase:
    """A short spatial scene of simple numbers: a ball and a box, at rest or moving, above a floor and beside a wall."""
    v = [draw(st.lists(st.integers(-3, 3), min_size=6, max_size=6)) for _ in range(2)]
    turn = draw(st.sampled_from([[0.0, 0.0, 0.0, 1.0], [0.6, 0.0, 0.0, 0.8], [0.5, 0.5, 0.5, 0.5]]))
    common = {"joint": "free_flyer", "mass": 10.0 ** draw(st.integers(-1, 1)), "inertia": [1e-3] * 3}
    bodies = [
        common | {"name": "ball", "shapes": [{"kind": "sphere", "radius": 0.05}], "velocity": [float(x) for x in v[0]],
                  "position": [0.0, 0.0, draw(st.sampled_from([0.05, 0.15])), 0.0, 0.0, 0.0, 1.0]},
        common | {"name": "box", "shapes": [{"kind": "box", "size": [0.1, 0.1, 0.1]}],
                  "velocity": [float(x) for x in v[1]], "position": [0.12, 0.0, 0.05, *turn]},
    ]  # fmt: skip
    contact = {
        "forces": "paper",
        "stiffness": 10.0 ** draw(st.integers(1, 3)), "damping": float(draw(st.sampled_from([0, 1]))),
        "restitution": draw(st.sampled_from([0.0, 0.5, 1.0])), "friction": draw(st.sampled_from([0.0, 0.3])),
    }  # fmt: skip
    walls = [{"name": "floor", "kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]},
             {"name": "side", "kind": "half_space", "point": [0.2, 0, 0], "normal": [-1, 0, 0]}]  # fmt: skip
    values = {"name": "small_scene_in_space", "dimensions": 3, "rate": 1000.0, "duration": steps / 1000.0,
              "bodies": bodies, "walls": walls, "gravity": draw(st.sampled_from([None, [0.0, 0.0, -10.0]])),
              "contact": contact, "integrator": "semi_implicit_euler"}  # fmt: skip
    return SceneCase(values, draw(st.sampled_from(["IAPB", "PB"])))
