"""The report of made-up records as a reader meets it in a browser that is cut off from everything
but its pages.

Wide and narrow, light and dark.
Without a browser the tests are skipped, and say so.
"""

import shutil
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from reports.figures import RECIPES
from reports.pages.builder import build_report, draw_all
from reports.pages.report import write_report
from tests.reports.made_up import EVIDENCE, figure_inputs

pytestmark = pytest.mark.thorough

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
)
DESK = (1400, 900)
PHONE = (400, 860)
FIGURES = ("hero", "fig07", "fig08", "fig03")
LEAST_CONTRAST = 4.5  # WCAG 2.2, level AA, text of ordinary size
REAL = Path(__file__).parents[2] / "out" / "report.html"
# What a page must be at any width; each returns what is wrong.
OUT_OF_SIGHT = """() => [...document.querySelectorAll("figure svg")]
    .filter((svg) => !svg.closest("details:not([open])") && !svg.parentElement.closest("svg"))
    .map((svg) => [svg.getAttribute("aria-label") || svg.className.baseVal, svg.getBoundingClientRect(),
                   svg.closest(".wide") !== null])  // a wide panel scrolls by itself
    .filter(([, box, scrolls]) => box.width < 5 || box.height < 5
                                  || (!scrolls && (box.left < -1 || box.right > innerWidth + 1)))
    .map(([name]) => name)"""
OVERFLOW = """() => document.documentElement.scrollWidth - innerWidth"""
CLIPPED = """() => [...document.querySelectorAll("p, h1, main h2, main h3, main li, main dd, button, summary")]
    .filter((part) => part.checkVisibility() && !part.closest(".scroll, .display, .steps, .plain"))
    .filter((part) => part.getBoundingClientRect().right > innerWidth + 1)
    .map((part) => part.textContent.slice(0, 60))"""
# Contrast of every text with the colour below it, WCAG's formula.
PALE = """(least) => {
    const canvas = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    const rgba = (color) => {
        canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = color; canvas.fillRect(0, 0, 1, 1);
        return [...canvas.getImageData(0, 0, 1, 1).data];
    };
    const linear = (v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    const light = (color) => color.slice(0, 3).map((v) => linear(v / 255))
        .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
    const below = (part) => {
        for (let place = part; place; place = place.parentElement) {
            const color = rgba(getComputedStyle(place).backgroundColor);
            if (color[3] === 255) return color;
        }
        return [255, 255, 255, 255];
    };
    const found = {};
    for (const part of document.querySelectorAll("body *")) {
        const own = [...part.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
        if (!own || !part.checkVisibility() || part.closest("script, .skip")) continue;
        const style = getComputedStyle(part);
        const [a, b] = [light(rgba(part.closest("svg") ? style.fill : style.color)), light(below(part))];
        const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        const name = `${part.tagName}.${part.className.baseVal ?? part.className}`;
        if (contrast < least) found[name] = contrast.toFixed(2);
    }
    return found;
}"""


@pytest.fixture(scope="module")
def evidence():
    """Made-up records: a little of each kind, a wide table and long words among them."""
    return replace(EVIDENCE, inputs=figure_inputs())


@pytest.fixture(scope="module")
def first(evidence, tmp_path_factory):
    """The first page of the report of made-up records, with a few figures of each kind."""
    recipes = [recipe for recipe in RECIPES if recipe.key in FIGURES]
    return write_report(
        tmp_path_factory.mktemp("page"), build_report(evidence, draw_all(evidence, recipes))
    )


@pytest.fixture(scope="module")
def started():
    """A browser; without one the tests are skipped, and say why."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip(f"no browser is installed (looked for {', '.join(NAMES)})")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def see(started, first):
    """Return ``see(page="figures", size=DESK, **context)``: a context manager that opens a page of
    the report, or a file, offline, and yields it and the errors that it reports."""

    @contextmanager
    def opened(page="figures", size=DESK, **context):
        path = page if isinstance(page, Path) else first.parent / "report" / f"{page}.html"
        view = {"width": size[0], "height": size[1]}
        room = started.new_context(viewport=view, offline=True, **context)
        sight = room.new_page()
        errors = []
        sight.on("console", lambda said: errors.append(said.text))
        sight.on("pageerror", lambda error: errors.append(str(error)))
        sight.goto(path.resolve().as_uri())
        yield sight, errors
        room.close()

    return opened


def pages_of(first):
    return [first, *sorted((first.parent / "report").glob("*.html"))]


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
@pytest.mark.parametrize("report", ["made up", "here"])
def test_each_page_is_whole(see, first, report, size):
    if report == "here" and not REAL.is_file():
        pytest.skip("no out/report.html here; `make reproduce` makes one")
    figures = 0
    given = first if report == "made up" else REAL
    with see(given, size) as (page, errors):
        for path in pages_of(given):
            page.goto(path.as_uri())
            assert errors == []
            assert page.evaluate(OUT_OF_SIGHT) == page.evaluate(CLIPPED) == []
            assert page.evaluate(OVERFLOW) <= 0
            figures += page.evaluate("() => document.querySelectorAll('figure').length")
        assert figures > len(FIGURES)


def test_the_checks_see_a_page_that_is_not_whole(see):
    with see() as (page, errors):
        page.evaluate("""() => {
            document.querySelector("main figure svg:not(.swatch)").style.height = "0";
            const wide = { textContent: "wide", style: "width: 3000px; max-width: none" };
            document.querySelector("main").append(Object.assign(document.createElement("p"), wide));
            document.querySelector("h2").style.color = "#888";
            document.body.append(Object.assign(new Image(), { src: "https://example.org/a.png" }));
        }""")
        page.wait_for_timeout(100)
        assert (
            len(page.evaluate(OUT_OF_SIGHT)) == 1
            and page.evaluate(OVERFLOW) > 1000
            and page.evaluate(CLIPPED) == ["wide"]
        )
        assert "H2." in page.evaluate(PALE, LEAST_CONTRAST)
        assert errors != []  # the page's own policy refused the picture, before any request


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_all_text_can_be_read(see, first, scheme):
    with see(color_scheme=scheme) as (page, _):
        for path in pages_of(first):
            page.goto(path.as_uri())
            page.evaluate(
                "() => document.querySelectorAll('details').forEach((part) => { part.open = true; })"
            )
            assert page.evaluate(PALE, LEAST_CONTRAST) == {}
