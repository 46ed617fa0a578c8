"""Kernels that copy records, made from the declarations of their arrays: what is declared is copied."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.linalg import load, store
from iapb.numerics.schema import Quantity

# how a line of an array is copied, by the dimensions of a line
_VECTOR = "store(to.{0}, i, load(given.{0}, j))"
_LONG = "copy_into(to.{0}[i], given.{0}[j])"
_OF_LINE = {(): "to.{0}[i] = given.{0}[j]", ("3",): _VECTOR, ("axis",): _VECTOR}


def copier(listed: Iterable[Quantity]) -> Any:
    """Return a kernel (to, given) that copies the listed arrays of a record, all of them vectors."""
    return _made("to, given", [f"copy_into(to.{each.name}, given.{each.name})" for each in listed])


def line_copier(listed: Iterable[Quantity]) -> Any:
    """Return a kernel (to, i, given, j) that copies line j of the listed arrays of a record to line
    i of those of another one."""
    lines = [_OF_LINE.get(each.dimensions[1:], _LONG).format(each.name) for each in listed]
    return _made("to, i, given, j", lines)


def _made(arguments: str, lines: list[str]) -> Any:
    scope = {"__name__": __name__, "copy_into": copy_into, "load": load, "store": store}
    exec(f"def copy({arguments}):\n " + "\n ".join(lines), scope)
    return kernel(scope["copy"])
