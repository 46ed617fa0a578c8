"""Counterexamples: shrink a failing impact, and write it as a test."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from reference.exact import independent_rows
from verification.impacts import ImpactCase
from verification.laws.bounds import FACTORED, KIT, ONE_SIDED, Bounds
from verification.laws.contracts import CONTRACTS, EXACT_LAWS

_DIGITS = (0, 1, 2, 4, 8)


def shrink(case: ImpactCase, fails: Callable[[ImpactCase], bool]) -> ImpactCase:
    """Return a smaller case that still fails, greedily; the case itself if nothing smaller does.

    The search ends, because each step removes the translations, a row, a coordinate, a restitution
    other than 1, or digits. The result depends only on the answers of `fails`.
    """
    improved = True
    while improved:
        improved = False
        for smaller in _smaller(case):
            if _is_valid(smaller) and fails(smaller):
                case, improved = smaller, True
                break
    return case


def _smaller(case: ImpactCase) -> Iterator[ImpactCase]:
    if case.translations is not None:
        yield replace(case, translations=None)
    for i in range(case.contacts):
        yield _without(case, ("contact_jacobian", "tangents", "friction", "unequal"), i, 0)
    if case.coordinates > 1 and case.translations is None:
        for k in range(case.coordinates):
            fewer = _without(
                case, ("velocity", "contact_jacobian", "tangents", "mass_matrix"), k, -1
            )
            yield _without(fewer, ("mass_matrix",), k, 0)
    for e in (1.0, 0.0):
        if case.unequal is None and case.restitution not in (1.0, e):
            yield replace(case, restitution=e)
    for digits in _DIGITS:
        for name in (
            "velocity",
            "contact_jacobian",
            "tangents",
            "mass_matrix",
            "friction",
            "unequal",
        ):
            yield from _rounded(case, name, digits)


def _without(case: ImpactCase, names: tuple[str, ...], index: int, axis: int) -> ImpactCase:
    """The case without this entry of the named arrays along an axis."""
    arrays = {name: getattr(case, name) for name in names}
    return replace(
        case,
        **{
            name: np.delete(array, index, axis)
            for name, array in arrays.items()
            if array is not None
        },
    )


def _rounded(case: ImpactCase, name: str, digits: int) -> Iterator[ImpactCase]:
    """Yield the case with the array rounded to `digits` decimals, if that makes the array's text
    shorter."""
    array = getattr(case, name)
    if array is None:
        return
    rounder = np.round(array, digits) + 0.0  # no −0.0
    if _length(rounder) < _length(array):
        yield replace(case, **{name: rounder})


def _length(array: np.ndarray) -> int:
    """Length of the array as text; each rounding must reduce it, so that shrinking ends."""
    return sum(len(repr(float(x))) for x in array.ravel())


def _is_valid(case: ImpactCase) -> bool:
    """Whether M is positive definite up to rounding, by elimination in a fixed order and without
    BLAS."""
    rows = case.mass_matrix.tolist()
    least = 1e-14 * max(rows[k][k] for k in range(len(rows)))
    for k, pivot_row in enumerate(rows):
        if not pivot_row[k] > least:
            return False
        for row in rows[k + 1 :]:
            factor = row[k] / pivot_row[k]
            row[k:] = [x - factor * y for x, y in zip(row[k:], pivot_row[k:], strict=True)]
    return tangents_are_independent(case)


# A counterexample as the source code of a test, to paste next to the resolver.

_BY_NAME = {"KIT": KIT, "FACTORED": FACTORED, "ONE_SIDED": ONE_SIDED}


def as_test(
    case: ImpactCase,
    law: str,
    bounds: Bounds = KIT,
    resolver: Any = None,
    contract: str = "equality",
) -> str:
    """Return the source code of a test of `law` on the case; if the resolver cannot be imported,
    its line is a gap."""
    arrays = {
        "mass_matrix": case.mass_matrix,
        "contact_jacobian": case.contact_jacobian,
        "velocity": case.velocity,
    }
    optional = {
        name: getattr(case, name) for name in ("translations", "tangents", "friction", "unequal")
    }
    optional = {name: array for name, array in optional.items() if array is not None}
    more = "".join(f", {name}={name}" for name in optional)
    table = "EXACT_LAWS" if law in EXACT_LAWS else CONTRACTS[contract].table
    table = "UNEQUAL_LAWS" if law.startswith("unequal_") else table
    name = next((name for name, known in _BY_NAME.items() if known == bounds), "")
    tolerances = name or repr(bounds).replace("=inf", "=np.inf")
    head = [
        f"from verification.laws import {table}, ImpactCase",
        f"from verification.laws.bounds import {name or 'Bounds'}",
        import_line(resolver) or "\n# resolver = ...  the one under test",
    ]
    lines = [
        "",
        "",
        f"def test_{law}():",
        *(f"    {key} = {_written(array)}" for key, array in (arrays | optional).items()),
        f"    case = ImpactCase(mass_matrix, contact_jacobian, velocity, {case.restitution!r}{more})",
        f"    residual = {table}[{law!r}].check(case, resolver, {tolerances})",
    ]
    return "\n".join(["import numpy as np", *head, *lines, "    assert residual.passed, residual"])


def import_line(resolver: Any) -> str:
    """Return the lines that import `resolver`; empty for a lambda or another function that cannot
    be imported."""
    inner = resolver.func if isinstance(resolver, partial) and not resolver.args else resolver
    module, name = getattr(inner, "__module__", None), getattr(inner, "__qualname__", "")
    if not isinstance(module, str) or module == "__main__":
        return ""
    if getattr(sys.modules.get(module), name, None) is not inner:
        return ""
    if inner is resolver:
        return f"from {module} import {name} as resolver"
    options = name_of(resolver, "partial")
    return f"from {module} import {name}\nfrom functools import partial\n\nresolver = {options}"


def name_of(resolver: Any, word: str = "") -> str:
    """Return the name of a resolver with the options of a partial; `word` writes it as a call of
    that function."""
    if isinstance(resolver, partial) and not resolver.args:
        options = ", ".join(f"{key}={value!r}" for key, value in resolver.keywords.items())
        name = getattr(resolver.func, "__name__", repr(resolver.func))
        return f"{word}({name}, {options})" if word else f"{name}({options})"
    return getattr(resolver, "__qualname__", None) or repr(resolver)


def _written(array: np.ndarray) -> str:
    """The array as source code; an empty array also needs its shape."""
    text = f"np.array({array.tolist()!r}, dtype=float)"
    return text if array.size else f"{text}.reshape({array.shape})"


def tangents_are_independent(case: ImpactCase) -> bool:
    """Whether the normal and the tangents of each contact are linearly independent; True without
    friction."""
    if case.tangents is None:
        return True
    blocks = np.concatenate([case.contact_jacobian[:, None], case.tangents], axis=1)
    return all(len(independent_rows(block)) == len(block) for block in blocks)
