"""The report as a reader meets it: wide and narrow, light and dark, by keyboard, on paper, without script."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.thorough

PHONE = (400, 800)
LEAST_CONTRAST = 4.5  # WCAG 2.2, level AA, text of ordinary size
REAL = Path(__file__).parents[3] / "out" / "report.html"
MOST_PRINTED = 6  # pages of paper for the first page
ANSWERED = ("Tested", "✓ Holds", "✕ Fails", "✓ Energy", "Known failures", "What next?")  # two screens of a phone
BELOW = """([texts, depth]) => texts.filter((text) => {
    const found = [...document.querySelectorAll(".first dt")]
        .find((part) => part.textContent.replace(/\\s+/g, " ").startsWith(text));
    return !found || found.getBoundingClientRect().bottom + scrollY > depth;
})"""

# What a page must be at any width; each returns what is wrong.
DEAD_ANCHORS = """() => [...document.querySelectorAll("a[href^='#']")].map((a) => a.getAttribute("href").slice(1))
    .filter((id) => !document.getElementById(id))"""
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
FOCUSED = "(names) => names.filter((name) => document.activeElement.matches(name))"


def check_page(sight: Any) -> None:
    assert sight.errors == []
    assert sight.requests == []
    assert sight.ask(DEAD_ANCHORS) == []
    assert sight.ask(OUT_OF_SIGHT) == []
    assert sight.ask(CLIPPED) == []
    assert sight.ask(OVERFLOW) <= 0


def pages_of(first: Path) -> list[Path]:
    return [first, *sorted((first.parent / "report").glob("*.html"))]


def test_each_page_is_whole_at_any_width(sight: Any, first: Path) -> None:
    figures = 0
    for path in pages_of(first):
        sight.page.goto(path.as_uri())
        check_page(sight)
        figures += sight.ask("() => document.querySelectorAll('figure').length")
    assert figures == 6


def test_the_checks_see_a_page_that_is_not_whole(desk: Any) -> None:
    desk.ask("""() => {
        document.querySelector("nav a").setAttribute("href", "#nowhere");
        document.querySelector("main figure svg:not(.swatch)").style.height = "0";
        const wide = { textContent: "wide", style: "width: 3000px" };
        document.querySelector("main").append(Object.assign(document.createElement("p"), wide));
        document.querySelector("h3").style.color = "#888";
        document.body.append(Object.assign(new Image(), { src: "https://example.org/a.png" }));
    }""")
    desk.page.wait_for_timeout(100)
    assert desk.ask(DEAD_ANCHORS) == ["nowhere"]
    assert len(desk.ask(OUT_OF_SIGHT)) == 1
    assert desk.ask(OVERFLOW) > 1000
    assert desk.ask(CLIPPED) == ["wide"]
    assert "H3." in desk.ask(PALE, LEAST_CONTRAST)
    assert desk.errors != []  # the page's own policy refused the picture, before any request


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_all_text_can_be_read(see: Callable[..., Any], first: Path, scheme: str) -> None:
    with see(color_scheme=scheme) as sight:
        for path in pages_of(first):
            sight.page.goto(path.as_uri())
            sight.ask("() => document.querySelectorAll('details').forEach((part) => { part.open = true; })")
            assert sight.ask(PALE, LEAST_CONTRAST) == {}


def test_without_script_the_content_is_there(see: Callable[..., Any], first: Path) -> None:
    with see(size=PHONE, java_script_enabled=False) as sight:
        page = sight.page
        assert page.locator("figure").count() == 3
        assert page.locator("#fig07 [data-curve] path").count() > 0
        assert page.locator("button:visible, input:visible").count() == 0
        assert sight.errors == []
    with see(first, PHONE, java_script_enabled=False) as sight:
        assert sight.page.locator("#film-corner svg animateTransform").count() == 4 * 2
    with see("scene-ledger", PHONE, java_script_enabled=False) as sight:
        box = sight.page.locator("#film-hole .panel > svg").bounding_box()
        assert box["width"] > 100 and box["height"] > 75
        assert sight.errors == []


REACHED = {"figures": {"#fig07 .legend button", "summary", ".scroll"},
           None: {".controls button", ".controls input", ".ways a"}}  # fmt: skip


@pytest.mark.parametrize("name", REACHED)
def test_the_keyboard_reaches_everything(see: Callable[..., Any], first: Path, name: str | None) -> None:
    with see(name or first) as sight:
        sight.ask("() => document.querySelectorAll('#fig07 details').forEach((part) => { part.open = true; })")
        sight.page.keyboard.press("Tab")
        assert sight.ask("() => document.activeElement.className") == "skip"
        reached: set[str] = set()
        for _ in range(120):
            sight.page.keyboard.press("Tab")
            reached |= set(sight.ask(FOCUSED, list(REACHED[name])))
        assert reached == REACHED[name]


def test_a_link_into_something_folded_unfolds_it(see: Callable[..., Any], first: Path) -> None:
    with see("claims") as sight:
        sight.ask("() => { location.hash = '#C01'; }")
        sight.page.wait_for_function("() => document.getElementById('C01').open")
        sight.page.goto(first.as_uri())
        sight.page.locator("main a", has_text="C01").click()
        sight.page.wait_for_function("() => document.getElementById('C01')?.open")


def test_print_shows_the_content_and_no_controls(see: Callable[..., Any]) -> None:
    for page, unfolded in (("claims", "#C01 .claim-body"), ("figures", "#fig07 .numbers table")):
        with see(page) as sight:
            sight.page.emulate_media(media="print")
            sight.ask("() => window.dispatchEvent(new Event('beforeprint'))")
            assert sight.page.locator(unfolded).is_visible()
            assert sight.page.locator(".controls:visible, .tools:visible, nav:visible").count() == 0
            assert len(sight.page.pdf()) > 10_000


@pytest.mark.skipif(not REAL.is_file(), reason="no out/report.html here; `make reproduce` makes one")
@pytest.mark.parametrize("width", [1400, 400])
def test_the_report_that_is_here(see: Callable[..., Any], width: int) -> None:
    with see(REAL, (width, 900)) as sight:
        for path in pages_of(REAL):
            sight.page.goto(path.as_uri())
            check_page(sight)


@pytest.mark.skipif(not REAL.is_file(), reason="no out/report.html here; `make reproduce` makes one")
@pytest.mark.parametrize(("size", "screens"), [((1400, 900), 1), ((400, 860), 2)])
def test_the_first_screens_answer_and_the_print_is_short(
    see: Callable[..., Any], size: tuple[int, int], screens: int
) -> None:
    with see(REAL, size) as sight:
        assert sight.page.evaluate(BELOW, [ANSWERED, screens * size[1]]) == []
        assert len(re.findall(rb"/Type\s*/Page[^s]", sight.page.pdf(format="A4"))) <= MOST_PRINTED
