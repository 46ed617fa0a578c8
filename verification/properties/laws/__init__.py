"""The laws by name. A law is a function (case, resolver, bounds) -> LawResidual, or None where it does not apply.

To add one: write the file, add a line to LAWS.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver
from verification.properties.laws.arguments import arguments_are_left_alone
from verification.properties.laws.coordinates import coordinates_do_not_matter
from verification.properties.laws.duplicated_rows import duplicated_rows_change_nothing
from verification.properties.laws.elastic import elastic_conserves
from verification.properties.laws.free_motion import free_motion_is_kept
from verification.properties.laws.groups import groups_do_not_interact
from verification.properties.laws.impulse_range import impulse_comes_from_the_contacts
from verification.properties.laws.kinetic_energy import kinetic_energy_never_rises
from verification.properties.laws.momentum import momentum_is_conserved, momentum_is_conserved_unequal
from verification.properties.laws.no_impulse import minus_one_is_no_impulse
from verification.properties.laws.redundancy import redundant_equals_reduced
from verification.properties.laws.repeatability import same_input_same_output
from verification.properties.laws.restitution import restitution_is_met
from verification.properties.laws.row_order import row_order_does_not_matter
from verification.properties.laws.row_scaling import row_scale_does_not_matter
from verification.properties.laws.units import units_do_not_matter

Check = Callable[[ImpactCase, Resolver, Bounds], LawResidual | None]


class Law(NamedTuple):
    """A law, in words and as a check."""

    statement: str
    check: Check


LAWS: dict[str, Law] = {
    "kinetic_energy": Law("KE⁺ ≤ KE⁻", kinetic_energy_never_rises),
    "restitution": Law("J v⁺ = −e J v⁻ on every row", restitution_is_met),
    "impulse_range": Law("M(v⁺ − v⁻) lies in range(Jᵀ)", impulse_comes_from_the_contacts),
    "free_motion": Law("f(v + z) = f(v) + z for J z = 0", free_motion_is_kept),
    "no_impulse": Law("e = −1 leaves v as it is", minus_one_is_no_impulse),
    "elastic": Law("e = 1 conserves KE", elastic_conserves),
    "momentum": Law("momentum along every free translation is conserved, in any frame", momentum_is_conserved),
    "redundancy": Law("redundant rows give what an independent subset gives (25), (33)", redundant_equals_reduced),
    "duplicated_rows": Law("a row given twice counts once", duplicated_rows_change_nothing),
    "row_order": Law("the order of the rows does not matter", row_order_does_not_matter),
    "row_scaling": Law("the scale of a row does not matter", row_scale_does_not_matter),
    "units": Law("the units of the coordinates do not matter", units_do_not_matter),
    "coordinates": Law("the choice of coordinates does not matter", coordinates_do_not_matter),
    "groups": Law("bodies that share no contact do not feel one another", groups_do_not_interact),
    "repeatability": Law("the same impact gives the same bits, whatever came before", same_input_same_output),
    "arguments": Law("the arguments are left as they were", arguments_are_left_alone),
}

# What holds for any law of unequal restitution, whatever it says of the separation velocities.
UNEQUAL_LAWS: dict[str, Law] = {
    f"unequal_{name}": Law(f"{LAWS[name].statement}, unequal e", LAWS[name].check)
    for name in ("kinetic_energy", "impulse_range", "momentum", "repeatability", "arguments")
}
UNEQUAL_LAWS["unequal_momentum"] = UNEQUAL_LAWS["unequal_momentum"]._replace(check=momentum_is_conserved_unequal)
