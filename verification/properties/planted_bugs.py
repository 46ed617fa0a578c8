"""The planted bugs by name, and the law that must catch each."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from verification.properties import planted
from verification.properties.case import Resolver


class PlantedBug(NamedTuple):
    """A bug by name: how to make the resolver, and a law that must catch it (others may as well)."""

    make: Callable[[], Resolver]
    caught_by: str


def _plain(resolver: Resolver, caught_by: str) -> PlantedBug:
    return PlantedBug(lambda: resolver, caught_by)


PLANTED_BUGS: dict[str, PlantedBug] = {
    "wrong_sign": _plain(planted.wrong_sign, "kinetic_energy"),
    "squared_restitution": _plain(planted.squared_restitution, "restitution"),
    "lost_one_plus": _plain(planted.lost_one_plus, "restitution"),
    "missing_half": _plain(planted.missing_half, "restitution"),
    "too_loose_rank": _plain(planted.too_loose_rank, "restitution"),
    "too_tight_rank": _plain(planted.too_tight_rank, "free_motion"),
    "transposed_factor": _plain(planted.transposed_factor, "impulse_range"),
    "forgotten_mass": _plain(planted.forgotten_mass, "kinetic_energy"),
    "diagonal_mass": _plain(planted.diagonal_mass, "coordinates"),
    "reversed_velocity": _plain(planted.reversed_velocity, "impulse_range"),
    "one_after_the_other": _plain(planted.one_after_the_other, "row_order"),
    "double_counted": _plain(planted.double_counted, "duplicated_rows"),
    "approaching_only": _plain(planted.approaching_only, "restitution"),
    "pulling_clipped": _plain(planted.pulling_clipped, "restitution"),
    "printed_formula": _plain(planted.printed_formula, "kinetic_energy"),
    "per_body_rows": _plain(planted.per_body_rows, "momentum"),
    "single_precision": _plain(planted.single_precision, "restitution"),
    "damped_formula": _plain(planted.damped_formula, "restitution"),
    "unscaled_rows": _plain(planted.unscaled_rows, "row_scaling"),
    "fails_without_contacts": _plain(planted.fails_without_contacts, "kinetic_energy"),
    "absolute_restitution": _plain(planted.absolute_restitution, "no_impulse"),
    "nearly_elastic": _plain(planted.nearly_elastic, "elastic"),
    "one_gradient_step": _plain(planted.one_gradient_step, "redundancy"),
    "short_rows_dropped": _plain(planted.short_rows_dropped, "units"),
    "three_rows_at_most": _plain(planted.three_rows_at_most, "groups"),
    "warm_start": PlantedBug(planted.makes_warm_start, "repeatability"),
    "nan_without_contacts": _plain(planted.nan_without_contacts, "kinetic_energy"),
    "column_of_velocities": _plain(planted.column_of_velocities, "kinetic_energy"),
    "writes_on_its_arguments": _plain(planted.writes_on_its_arguments, "arguments"),
    "gives_up": _plain(planted.gives_up, "kinetic_energy"),
    "stale_jacobian": PlantedBug(planted.makes_stale_jacobian, "restitution"),
    "returns_too_much": _plain(planted.returns_too_much, "kinetic_energy"),
}
