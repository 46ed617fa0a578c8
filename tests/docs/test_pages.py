"""The pages of docs/ and the code speak of the same things: links, equations, notation, and the
reference."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest
from numpydoc.validate import validate

from iapb import find_scene, simulate
from reports.store.schema import GROUPS

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("iapb", "reference", "verification", "reports")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
NOTATION = (ROOT / "docs/notation.md").read_text(encoding="utf-8")
EQUATIONS = re.findall(
    r"^\| \((\d+)\) \|.*?\| ([^|]+) \|$",
    (ROOT / "docs/equations.md").read_text(encoding="utf-8"),
    flags=re.MULTILINE,
)
API = sorted((ROOT / "docs/api").glob("*.md"))
PUBLIC = [
    (package, name)
    for package in PACKAGES
    for name in getattr(import_module(package), "__all__", ())
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        path, _, anchor = target.partition("#")
        found = (page.parent / path) if path else page
        if not target.startswith("http"):
            assert found.exists(), f"{page.name}: {target} leads nowhere"
            headings = (
                re.findall(r"^#+ (.+)$", found.read_text(encoding="utf-8"), flags=re.M)
                if anchor
                else []
            )
            anchors = {
                re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings
            }
            assert not anchor or anchor in anchors, (
                f"{page.name}: {found.name} has no heading for #{anchor}"
            )


def test_every_equation_has_its_row_and_its_links_lead_to_functions_or_statements():
    assert [number for number, _ in EQUATIONS] == [str(number) for number in range(1, 42)]
    for number, row in EQUATIONS:
        links = re.findall(r"`([\w/]+\.(?:py|txt)):(\w+)`", row)
        assert links or row.startswith("not used, because "), number
        assert len(links) == len(re.findall(r"\.(?:py|txt)", row)), (
            f"({number}): a path without a function"
        )
        for file, name in links:
            defined = re.compile(rf"^(?:\s*(?:async )?def |class |){name}\b", flags=re.M)
            assert defined.search((ROOT / file).read_text(encoding="utf-8")), (
                f"({number}): {file}:{name}"
            )


def test_the_names_and_units_of_notation_are_those_of_the_code_and_the_run_files():
    ledger = set(simulate(find_scene("peg_corner"), steps=1).energy)
    code = "\n".join(
        path.read_text() for package in PACKAGES for path in (ROOT / package).rglob("*.py")
    )
    words = set(re.findall(r"\w+", code)) | ledger
    names = set(re.findall(r"`([A-Za-z_][\w.]*)`", NOTATION))
    assert len(names) > 50 and not {name for name in names if not set(name.split(".")) <= words}
    assert not [name for name in ledger if f"`{name}`" not in NOTATION]
    rows = [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        for line in NOTATION.splitlines()
    ]
    for quantity in (quantity for quantities, _ in GROUPS.values() for quantity in quantities):
        units = {
            unit.strip().replace("–", "1")
            for cells in rows
            if len(cells) == 5 and f"`{quantity.name}`" in cells[1]
            for unit in re.split(r"\\\||,", cells[2])
        }
        wanted = (
            {quantity.unit}
            if isinstance(quantity.unit, str)
            else set(quantity.unit.values()) - {"1"}
        )
        assert units and wanted <= units, (
            f"{quantity.name}: the page says {units}, the file {wanted}"
        )


def public_functions(module):
    """Functions and methods that a module defines and does not hide."""
    for name, value in vars(module).items():
        if name.startswith("_") or getattr(value, "__module__", "") != module.__name__:
            continue
        inside = vars(value).items() if inspect.isclass(value) else [("", value)]
        yield from (
            (f"{name}.{inner}", function)
            for inner, function in inside
            if inspect.isfunction(function) and not inner.startswith("_")
        )


@pytest.mark.parametrize("page", API, ids=lambda page: page.stem)
def test_whatever_the_reference_shows_has_a_docstring(page):
    assert f"api/{page.stem}" in (ROOT / "docs/index.md").read_text(encoding="utf-8")
    for name in re.findall(r"automodule:: ([\w.]+)", page.read_text(encoding="utf-8")):
        module = import_module(name)
        assert module.__doc__
        assert not [
            place for place, function in public_functions(module) if not inspect.getdoc(function)
        ]


@pytest.mark.parametrize(("package", "name"), PUBLIC, ids=[".".join(each) for each in PUBLIC])
def test_names_of_the_packages_say_what_goes_in_and_out(package, name):
    value = getattr(import_module(package), name)
    text = inspect.getdoc(value) or ""
    assert text or not inspect.isclass(value)
    if inspect.isfunction(value):
        found = validate(f"{value.__module__}.{name}")["errors"]
        lacking = [said for code, said in found if code in ("PR01", "PR02", "RT01")]
        raises = re.search(r"^\s+raise ", inspect.getsource(value), flags=re.M)
        assert not lacking and (not raises or "\nRaises\n------" in text)
