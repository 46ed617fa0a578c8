"""The report of made-up records in a headless browser that is cut off from everything but the report's pages.

Without a browser the tests are skipped, and say so.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from iapb.run import Run
from reports.evidence.runs import TILTED
from reports.figures import RECIPES
from reports.figures.corner import UNLIMITED
from reports.figures.paper import arm_energies
from reports.pages.builder import build_report
from reports.pages.records import Evidence
from reports.report import write_report
from tests.reports.figure_inputs import made_motion
from verification.finding import MIXED, REPRODUCED, Part, finding_of
from verification.table import titled

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip
DESK, PHONE = (1400, 900), (400, 800)
FIGURES = ("hero", "fig07", "fig08", "film-corner", "film-hole", "fig03")


@dataclass
class Sight:
    """A page in a browser, and what it did that it should not: `errors` of its console, `requests` beside its own."""

    page: Any
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def ask(self, script: str, argument: Any = None) -> Any:
        """Return what a script says inside the page."""
        return self.page.evaluate(script, argument)


@contextmanager
def browser() -> Iterator[Any]:
    """Start a browser, or skip the test and say why."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip(f"no browser is installed (looked for {', '.join(NAMES)})")
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=found, args=list(ARGUMENTS))
        yield started
        started.close()


@contextmanager
def opened(started: Any, path: Path, size: tuple[int, int] = DESK, **context: Any) -> Iterator[Sight]:
    """Open a page; any request of it but for another page of the report is refused and remembered."""
    own = path.resolve().as_uri()
    pages = {page.resolve().as_uri() for page in path.parents[path.parent.name == "report"].rglob("*.html")}
    room = started.new_context(viewport={"width": size[0], "height": size[1]}, offline=True, **context)
    sight = Sight(room.new_page())

    def judge(route: Any) -> None:
        if route.request.url.split("#")[0] in pages or route.request.url.startswith("data:"):
            route.continue_()
        else:
            sight.requests.append(route.request.url)
            route.abort()

    room.route("**/*", judge)
    sight.page.on("console", lambda said: said.type in ("error", "warning") and sight.errors.append(said.text))
    sight.page.on("pageerror", lambda error: sight.errors.append(str(error)))
    sight.page.goto(own)
    yield sight
    room.close()


@pytest.fixture(scope="session")
def evidence(make_run: Callable[..., Run]) -> Evidence:
    """Made-up records: a little of each kind, wide tables and long words among them."""
    recipes = [recipe for recipe in RECIPES if recipe.key in FIGURES]
    names = sorted({name for recipe in recipes for name in recipe.needs if "/" in name})
    runs = {name: made_motion(make_run, "peg_corner", k) for k, name in enumerate(names)}
    tilted = {tilt: {name: runs[f"corner/{name}"] for name in UNLIMITED} for tilt in (0.0, 0.015, 0.3)}
    table = titled(tuple(f"a long heading {k}" for k in range(12)), (("word", *range(11)),))
    return Evidence(
        inputs={**runs, TILTED: tilted, "arm_energies": arm_energies()},
        claims=(finding_of("C01", "C01", "energy never rises", "half: $\\frac{1}{2}$",
                           (Part("p.", MIXED, "as printed"),), {"C01": table}),),
        topics=(finding_of("scene-ledger", "The scenes", "Asked.", "It holds.", (Part("It holds.", REPRODUCED),),
                           {"wide": table}),),
        provenance={"commit": "0123456789abcdef" * 4},
    )


@pytest.fixture(scope="session")
def first(evidence: Evidence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first page of the report of made-up records, with a few figures of each kind."""
    recipes = [recipe for recipe in RECIPES if recipe.key in FIGURES]
    return write_report(tmp_path_factory.mktemp("page"), build_report(evidence, recipes))


@pytest.fixture(scope="module")
def started() -> Iterator[Any]:
    """A browser for the tests of one file; its loop would be in the way of other files' tests."""
    with browser() as found:
        yield found


@pytest.fixture(scope="module", params=[DESK, PHONE], ids=["desk", "phone"])
def sight(request: pytest.FixtureRequest, started: Any, first: Path) -> Iterator[Sight]:
    """The first page at both widths, to look at and to go on from."""
    with opened(started, first, request.param) as seen:
        yield seen


@pytest.fixture
def see(started: Any, first: Path) -> Callable[..., Any]:
    """Return ``see(page="figures", size=DESK, **context)``: a context manager that opens a section's page or a file."""

    def open_page(page: str | Path = "figures", size: tuple[int, int] = DESK, **context: Any) -> Any:
        path = page if isinstance(page, Path) else first.parent / "report" / f"{page}.html"
        return opened(started, path, size, **context)

    return open_page


@pytest.fixture
def desk(see: Callable[..., Any]) -> Iterator[Sight]:
    """The page of the figures, one's own, to change."""
    with see() as seen:
        yield seen
