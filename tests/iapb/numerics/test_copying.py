"""Kernels that copy records: every declared array is copied, and nothing else changes."""

from __future__ import annotations

import numpy as np

from iapb.contact.geometry import ContactBuffer
from iapb.numerics.copying import copier, line_copier
from iapb.numerics.schema import quantities, zeros_of
from iapb.run import ImpactTable


def numbered(record, **lengths):
    """Return a record whose entries all differ from zero."""
    made = zeros_of(record, **lengths)
    for each in quantities(record):
        array = getattr(made, each.name)
        array[...] = np.arange(1, array.size + 1).reshape(array.shape)
    return made


def test_a_line_is_copied_whole_and_the_others_stay() -> None:
    for record, lengths in (
        (ContactBuffer, {"contact": 3}),
        (ImpactTable, {"impact": 3, "velocity": 4, "coordinate": 5}),
    ):
        given = numbered(record, **lengths)
        target = zeros_of(record, **lengths)
        line_copier(quantities(record))(target, 0, given, 2)
        for each in quantities(record):
            array = getattr(target, each.name)
            assert np.array_equal(array[0], getattr(given, each.name)[2]), each.name
            assert not array[1:].any(), each.name


def test_vectors_are_copied() -> None:
    vectors = [each for each in quantities(ContactBuffer) if len(each.dimensions) == 1]
    given = numbered(ContactBuffer, contact=3)
    target = zeros_of(ContactBuffer, contact=3)
    copier(vectors)(target, given)
    assert all(
        np.array_equal(getattr(target, each.name), getattr(given, each.name)) for each in vectors
    )
