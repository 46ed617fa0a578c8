"""Exact linear algebra for instances: inverse, Moore-Penrose inverse, rank, on python-flint's rationals."""

from __future__ import annotations

from typing import Any

from verification.proofs.exact import FlintBackend, Instance, Matrix, Rows, instance


def exact_rows(rows: Rows) -> Matrix:
    """Any exact entries as a matrix of Fractions."""
    return instance(rows=rows).values["rows"]  # type: ignore[return-value]


def inverse(rows: Rows) -> Matrix:
    """Exact inverse; ZeroDivisionError if there is none."""
    return FlintBackend.rows(FlintBackend.matrix(exact_rows(rows)).inv())


def rank(rows: Rows) -> int:
    return FlintBackend.matrix(exact_rows(rows)).rref()[1]


def pseudo_inverse(rows: Rows) -> Matrix:
    """Exact Moore-Penrose inverse by full-rank factorisation: A = B C, A† = Cᵀ (C Cᵀ)⁻¹ (Bᵀ B)⁻¹ Bᵀ."""
    a = FlintBackend.matrix(exact_rows(rows))
    reduced, size = a.rref()
    if size == 0:
        return FlintBackend.rows(a.transpose())
    table = FlintBackend.rows(reduced)
    pivots = [next(j for j, entry in enumerate(row) if entry) for row in table[:size]]
    b: Any = FlintBackend.matrix([[row[j] for j in pivots] for row in exact_rows(rows)])
    c: Any = FlintBackend.matrix(table[:size])
    left = c.transpose() * (c * c.transpose()).inv()
    right = (b.transpose() * b).inv() * b.transpose()
    return FlintBackend.rows(left * right)


def delassus(mass: Rows, jacobian: Rows) -> Matrix:
    """J M⁻¹ Jᵀ."""
    j = FlintBackend.matrix(exact_rows(jacobian))
    return FlintBackend.rows(j * FlintBackend.matrix(inverse(mass)) * j.transpose())


def impact_case(mass: Rows, jacobian: Rows, velocity: list[Any], **scalars: Any) -> Instance:
    """An impact with M, M⁻¹, J, G = (J M⁻¹ Jᵀ)† and v filled in; scalars such as e by name."""
    values = {"M": mass, "M⁻¹": inverse(mass), "J": jacobian, "v": velocity}
    return instance({**values, "G": pseudo_inverse(delassus(mass, jacobian))}, **scalars)
