"""The schema of recorded quantities and of the kernels' arrays: each is declared once, as a field
of its record.

A field ``name: Annotated[Floats, "step velocity", FORCE, "friction forces"]`` gives an array its
name, type, dimensions, unit and meaning. Arrays that are not recorded give the dimensions
alone: ``Annotated[Floats, "velocity"]``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Indices = NDArray[np.int32]
Booleans = NDArray[np.bool_]
States = NDArray[np.int8]
Record = TypeVar("Record")

# arrays of the kernels' records, by their dimensions
FloatPerVelocity = Annotated[Floats, "velocity"]
FloatPerRow = Annotated[Floats, "row"]
FloatPerTool = Annotated[Floats, "tool"]
FloatPerContact = Annotated[Floats, "contact"]
FloatPerCoordinate = Annotated[Floats, "coordinate"]
VectorPerContact = Annotated[Floats, "contact 3"]
VectorPerBody = Annotated[Floats, "body 3"]
VelocityMatrix = Annotated[Floats, "velocity velocity"]
FlagPerTree = Annotated[Booleans, "tree"]
FlagPerContact = Annotated[Booleans, "contact"]
NumberPerTree = Annotated[Integers, "tree"]
NumberPerVelocity = Annotated[Integers, "velocity"]
IndexPerContact = Annotated[Indices, "contact"]
FloatPerTangent = Annotated[Floats, "tangent"]
FloatPerToolCoordinate = Annotated[Floats, "tool_coordinate"]
FloatPerRestRow = Annotated[Floats, "rest_row"]
NumberPerContact = Annotated[Integers, "contact"]
VelocityRows = Annotated[Floats, "velocity row"]
SingleFloat = Annotated[Floats, "1"]
SingleInteger = Annotated[Integers, "1"]

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


def quantities(record: type, first: str = "") -> tuple[Quantity, ...]:
    """Return the arrays of a record class in order; if `first` is given, only those along this
    dimension."""
    return tuple(
        quantity for quantity in _declared(record) if first in ("", quantity.dimensions[0])
    )


@cache
def _declared(record: Any) -> tuple[Quantity, ...]:
    hints = get_type_hints(record, include_extras=True).items()
    return tuple(
        _quantity(name, *get_args(hint)) for name, hint in hints if hasattr(hint, "__metadata__")
    )


def _quantity(
    name: str, kind: Any, dimensions: str, unit: Any = "1", meaning: str = ""
) -> Quantity:
    return Quantity(name, tuple(dimensions.split()), _dtype(kind), unit, meaning)


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
