"""docs/notation.md and the code speak of the same things."""

from __future__ import annotations

import re

import pytest
from blocks import PACKAGES, ROOT

from iapb import find_scene, simulate
from reports.store.schema import GROUPS

PAGE = (ROOT / "docs/notation.md").read_text(encoding="utf-8")
QUANTITIES = [(group, quantity) for group, (quantities, _) in GROUPS.items() for quantity in quantities]


def units_of(name: str) -> set[str]:
    """Units that the page gives to a code name, wherever a table has a unit column."""
    units = set()
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 5 and re.search(rf"`{name}`", cells[1]):
            units |= {unit.strip().replace("–", "1") for unit in re.split(r"\\\||,", cells[2])}
    return units


@pytest.fixture(scope="module")
def ledger() -> set[str]:
    """Names of the energies in a run."""
    return set(simulate(find_scene("peg_corner"), steps=1).energy)


def test_names_exist_in_the_code(ledger: set[str]) -> None:
    code = "\n".join(path.read_text() for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
    words = set(re.findall(r"\w+", code)) | ledger
    names = set(re.findall(r"`([A-Za-z_][\w.]*)`", PAGE))
    assert len(names) > 50
    assert not {name for name in names if not set(name.split(".")) <= words}


@pytest.mark.parametrize(("group", "quantity"), QUANTITIES, ids=[f"{group}/{each.name}" for group, each in QUANTITIES])
def test_run_file_quantities_are_explained(group: str, quantity: object) -> None:
    name, unit = quantity.name, quantity.unit  # type: ignore[attr-defined]
    given = units_of(name)
    assert given, f"{group}/{name} is not in docs/notation.md"
    wanted = {unit} if isinstance(unit, str) else set(unit.values()) - {"1"}
    assert wanted <= given, f"{group}/{name}: the page says {given}, the file {wanted}"


def test_ledger_is_explained(ledger: set[str]) -> None:
    assert not [name for name in ledger if f"`{name}`" not in PAGE]


def test_a_wrong_unit_would_be_seen() -> None:
    assert units_of("gap") == {"m"}
    assert not units_of("no_such_quantity")
