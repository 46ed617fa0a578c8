"""The schema of recorded quantities and of the kernels' arrays: each is declared once, as a field
of its record.

A field ``name: Annotated[Floats, quantity("step velocity", FORCE, "friction forces")]`` gives an
array its name, type, dimensions, unit and meaning. Arrays that are not recorded give the dimensions
alone: ``Annotated[Floats, "velocity"]``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Indices = NDArray[np.int32]
Booleans = NDArray[np.bool_]
States = NDArray[np.int8]
Record = TypeVar("Record")

_hints: Callable[..., dict[str, Any]] = cache(get_type_hints)  # 0.3 ms for the state of a world


class Quantity(NamedTuple):
    """An array of a record: its name (also the attribute), dimensions, type, unit and meaning.

    For a generalized quantity, `unit` maps the unit of each coordinate (or of each velocity) to the
    unit of the quantity.
    """

    name: str
    dimensions: tuple[str, ...]
    dtype: type
    unit: str | dict[str, str]
    meaning: str


def quantity(dimensions: str, unit: str | dict[str, str] = "1", meaning: str = "") -> Quantity:
    """Return the declaration of an array, for `Annotated`; the field adds name and type."""
    return Quantity("", tuple(dimensions.split()), float, unit, meaning)


def quantities(record: type, first: str = "") -> tuple[Quantity, ...]:
    """Return the arrays of a record class in order; if `first` is given, only those along this
    dimension."""
    return tuple(
        quantity for quantity in _declared(record) if first in ("", quantity.dimensions[0])
    )


@cache
def _declared(record: Any) -> tuple[Quantity, ...]:
    hints = get_type_hints(record, include_extras=True)
    found = (
        (name, *get_args(hint)) for name, hint in hints.items() if hasattr(hint, "__metadata__")
    )
    return tuple(
        (quantity(said) if isinstance(said, str) else said)._replace(name=name, dtype=_dtype(kind))
        for name, kind, said in found
    )


def _dtype(kind: Any) -> type:
    """Return the type of the entries of NDArray[…]; some releases of numpy nest it in a dtype."""
    last = get_args(kind)[-1]
    return next(iter(get_args(last)), last)


def blank(
    listed: Iterable[Quantity],
    lengths: Mapping[str, int],
    make: Callable[..., NDArray[Any]] = np.zeros,
) -> dict[str, NDArray[Any]]:
    """Return one array per quantity, by name, made by `make`; `lengths` of dimensions that are no
    numbers."""
    return {
        each.name: make(
            [lengths[name] if name in lengths else int(name) for name in each.dimensions],
            each.dtype,
        )
        for each in listed
    }


def zeros_of(record: type[Record], **lengths: int) -> Record:
    """Return a record of arrays of zeros, and of such records, by the lengths of their
    dimensions."""
    nested = {
        name: zeros_of(kind, **lengths)
        for name, kind in _hints(record).items()
        if hasattr(kind, "_fields")
    }
    return record(**blank(quantities(record), lengths), **nested)
