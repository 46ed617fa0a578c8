"""What the pytest plug-in asks of the kits: a marker with a `device` is for a force law, any other for
an impact resolver."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from verification.laws.kit import Report, check_passivity, choose_laws, laws_named
from verification.port.kit import check_force
from verification.port.laws import FORCE_LAWS


def laws_of(asked: dict[str, Any]) -> Iterable[str]:
    """Return the names of the laws that a marker asks for."""
    if "device" in asked:
        return laws_named(FORCE_LAWS, asked.get("laws") or list(FORCE_LAWS))
    unequal = asked.get("unequal_restitution", False)
    return choose_laws(asked.get("contract", "equality"), asked.get("laws"), unequal)


def judged(subject: Any, law: str, impacts: int, asked: dict[str, Any]) -> Report:
    """Judge one law as a marker asks."""
    options = {"impacts": impacts} | asked | {"laws": [law]}
    if "device" in asked:
        del options["impacts"]
        return check_force(subject, **options)
    return check_passivity(subject, **options)
