"""The page: whole, self-contained, honest about what is missing."""

from __future__ import annotations

import base64
import hashlib
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from iapb.errors import ArgumentError
from reports import report
from reports.figures.figure import Cell, Figure, Panel, Recipe, grid
from reports.figures.two_link_arm import arm_energies
from reports.pages.builder import FIRST_PAGE, OUTCOME_MARKS, build_report, link_across
from reports.pages.formulas import formula, prose
from reports.pages.records import Evidence, StoredFile
from reports.pages.sections import SECTIONS
from reports.pages.terms import TERMS, explained, readable, terms_of
from reports.report import ARCHIVE_NAME, LARGEST_FIRST, write_report
from tests.reports.joined import joined
from verification.claims import CLAIMS
from verification.claims.conditions import full_grid
from verification.claims.peg import FULL
from verification.finding import MIXED, NOT_COMPUTED, REFUTED, REPRODUCED, VERDICTS, Finding, Part, finding_of
from verification.hard_cases.study import finding_on, on_hard_cases
from verification.laws.topic import counterexample, properties
from verification.table import Column, table_of, titled

VOID = {"meta", "link", "br", "img", "input", "hr"}


class Outline(HTMLParser):
    """What the tests ask of a page: identifiers, links, and tags that were not closed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.tags: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        given = dict(attrs)
        if given.get("id"):
            self.ids.append(str(given["id"]))
        self.links += [str(given[name]) for name in ("href", "src", "xlink:href") if given.get(name)]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


SKIPPED = Finding("bowl", "bowl", "", "needs bowl.lcp", NOT_COMPUTED, details={"source": "published problems"})


def _hard_case(*rows: tuple[Any, ...], title: str = "bar") -> Finding:
    numbers = titled(("method", "outcome", "forward error"), rows)
    details = {"source": "ours", "kind": "impact", "why it is hard": "$0.5$ J", "truth": "exact", "expected": "no gain"}
    return finding_on("bar", title, numbers, details)


@pytest.fixture(scope="module")
def full() -> Evidence:
    claim = finding_of("C01", "C01", "KE never rises <b>", "half of the printed loss: $\\frac{1}{2}$",
                       (Part("as printed.", MIXED, "as printed"),), {"C01": titled(("κ", "gain"), ((1e3, 2e-16),))})
    law = {"law": "KE", "cases": 10, "worst": 0.0, "bound": 1.0, "holds": True, "fault": "sign", "fault caught": True}
    return Evidence(
        inputs={"arm_energies": arm_energies()},
        claims=(claim, finding_of("C02", "C02", "the same", "no", (Part("n.", REFUTED),))),
        hard_cases=(_hard_case(("factored", "stable", 1e-16)),),
        counterexamples=(counterexample("gram_pinv", "no gain", "It gains.", {"e": 0.5}, "assert gain <= 0"),
                         counterexample("saturate", "passive", "It gains too.", {"M": [[1]]})),
        topics=(finding_of("properties", "Energy", "", "It never rises.", (Part("It never rises.", REPRODUCED),),
                           {"laws": properties.checks[0].table_of([law])}),
                finding_of("mechanics", "Linkages", "Asked <here>.", "All hold.",
                           (Part("It holds to 1e-14.", REPRODUCED),),
                           {"trees": titled(("joints", "error"), ((3, 1e-14),))}),),
        effects={"peg": titled(
            ("effect", "active", "reason", "left out", "cost", "change"),
            [("gravity", False, "none in the scene", "", None, None)])},
        provenance={"commit": "abc"},
        manifest=(StoredFile("a", "runs/a.h5", "k" * 64, "c" * 64, "iapb run a"),),
    )


@pytest.fixture(scope="module", params=["empty", "full"])
def pages(request: pytest.FixtureRequest, full: Evidence) -> dict[str, str]:
    return build_report(full if request.param == "full" else Evidence())


def test_the_page_says_where_its_files_are_of_several_machines(full: Evidence) -> None:
    other = [replace(full.manifest[0], file=f"runs/{kernel}.h5", made_on=f"a processor, {kernel}")
             for kernel in ("Haswell", "Haswell2", "SkylakeX")]  # fmt: skip
    page = " ".join(joined(replace(full, manifest=tuple(other))).split())
    assert "Mixed provenance." in page and "1 on a processor, SkylakeX" in page and "on 3 combinations" in page
    alike = tuple(replace(one, made_on="a processor, Haswell") for one in other)
    assert "Mixed provenance." not in joined(replace(full, manifest=alike))


def test_each_page_is_well_formed(pages: dict[str, str]) -> None:
    for page in pages.values():
        outline = Outline(page)
        assert outline.wrong == []
        assert outline.open == []
        assert len(outline.ids) == len(set(outline.ids))


def test_each_page_asks_for_nothing_and_runs_only_its_own_script(pages: dict[str, str]) -> None:
    for name, page in pages.items():
        outside = {link.split("#")[0] for link in Outline(page).links if not link.startswith("#")} - {"data:,"}
        assert {(Path(name).parent / link).as_posix().replace("report/../", "") for link in outside} <= set(pages)
        (script,) = re.findall(r"<script>(.*?)</script>", page, flags=re.S)
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"script-src &#39;sha256-{digest}&#39;" in page
        assert not re.search(r"\son\w+=|fetch\(|XMLHttpRequest|import\(|eval\(", page)
        assert not re.search(r"@import|url\((?!#)", page)


def test_every_anchor_resolves(pages: dict[str, str]) -> None:
    ids = {name.rpartition("/")[2]: set(Outline(page).ids) for name, page in pages.items()}
    for name, page in pages.items():
        for link in Outline(page).links:
            file, mark, anchor = link.partition("#")
            assert not mark or anchor in ids[(file or name).rpartition("/")[2]], (name, link)


def test_a_link_to_an_id_of_no_page_is_an_error() -> None:
    pages = {"a.html": '<a href="#x">', "report/b.html": '<p id="x"><a href="#x"><a href="#y">', "c.html": '<p id="y">'}
    assert link_across(pages) == {"a.html": '<a href="report/b.html#x">', "c.html": '<p id="y">',
                                  "report/b.html": '<p id="x"><a href="#x"><a href="../c.html#y">'}
    with pytest.raises(KeyError, match="z"):
        link_across({"a.html": '<a href="#z">'})


def test_every_section_has_its_page_and_every_page_leads_to_it(pages: dict[str, str]) -> None:
    assert list(pages) == [FIRST_PAGE, *(section.page for section in SECTIONS)]
    for section in SECTIONS:
        assert section.id in Outline(pages[section.page]).ids
        assert all(f"{section.id}.html#{section.id}" in page for name, page in pages.items() if name != section.page)


def test_what_was_not_computed_is_said() -> None:
    page = joined(Evidence())
    empty = [section for section in SECTIONS if not section.ready(Evidence())]
    assert page.count("<p class=\"absent\">Not computed in this run.</p>") == len(empty)
    assert not any("reproduced" in part.split("<body>")[1] for part in build_report(Evidence()).values())


def test_a_page_repeats_byte_for_byte(full: Evidence) -> None:
    assert build_report(full) == build_report(full)


def test_a_short_formula_has_the_signs_of_the_long_one() -> None:
    from latex2mathml.converter import convert

    latex = r"0 \le p < 1, \quad J^{\top} p \, = \, x \& y"
    long, short = (ElementTree.fromstring(text.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', ""))
                   for text in (convert(latex), str(formula(latex))))
    assert [piece.strip() for piece in short.itertext()] == [piece.strip() for piece in long.itertext()]
    assert len(str(formula(latex))) < 0.8 * len(convert(latex))


def test_outcomes_are_told_by_a_mark_as_well_as_by_colour() -> None:
    assert set(OUTCOME_MARKS) == set(VERDICTS)
    assert len(set(OUTCOME_MARKS.values())) == len(VERDICTS)


def test_the_page_says_what_the_records_say_escaped_and_counted(full: Evidence) -> None:
    page = joined(full)
    for text in ("KE never rises &lt;b&gt;", "<mfrac>", f"1 {MIXED}", f"1 {REFUTED}", "Asked &lt;here&gt;.",
                 "It holds to 10<sup>−14</sup>.", "<summary>Trees</summary>", "<code>assert gain &lt;= 0</code>",
                 '<th scope="row">e</th><td><code>0.5</code>', "[[1]]"):
        assert text in page, text
    assert page.count("and a test to paste") == 1


def test_hard_cases_are_seen_at_a_glance_and_a_refusal_or_an_empty_table_is_no_number() -> None:
    case = _hard_case(("factored", "stable", 1e-16), ("gram", "refused", None))
    page = joined(Evidence(hard_cases=(case, SKIPPED), topics=(on_hard_cases(()),)))
    for text in ('<span class="good">✓</span> factored: stable', '<span class="bad">✕</span> gram: refused',
                 "1 of 2 stable", "Skipped: needs bowl.lcp.", "0 of 0 hard cases"):
        assert text in page, text
    assert "not a number" not in page


@pytest.mark.parametrize(("text", "shown"), [
    ("at most 2.0e-16 of it", "at most 2.0 · 10<sup>−16</sup> of it"), ("1e8", "10<sup>8</sup>"),
    ("0.0e+00", "0"), ("-3e+00", "−3"), ("e in [-1, 1]", "e in [−1, 1]"), ("2005-06", "2005-06"),
    ("key a1e5b", "key a1e5b"), ("p >= 0 <= q", "p ≥ 0 ≤ q"), ("costs 5$ <i>", "costs 5$ &lt;i&gt;"),
])
def test_powers_of_ten_read_as_people_write_them(text: str, shown: str) -> None:
    assert str(prose(text)).replace("\u202f", " ") == shown


def test_the_first_page_names_the_hard_cases_that_the_engine_fails() -> None:
    stable = _hard_case(("IAPB", "stable", 0.0))
    found = on_hard_cases((stable, _hard_case(("IAPB", "gains energy", 0.5), title="stiff wall")))
    assert found.verdict == MIXED
    assert "1 of 2" in found.answer and "stiff wall (gains energy)" in found.answer
    found = on_hard_cases((stable, SKIPPED))
    assert found.verdict == REPRODUCED and "1 were skipped" in found.answer


def test_a_topic_with_an_answer_stands_on_the_first_page_with_the_worst_of_its_findings() -> None:
    parts = (Part("a", REPRODUCED), Part("b", MIXED))
    topics = (finding_of("mechanics", "Linkages", "", "Most hold.", parts),
              finding_of("scene-ledger", "Scenes", "", "", parts))
    first = joined(Evidence(topics=topics)).split('<section id="verdict"')[1].split("</section>")[0]
    assert "Most hold." in first and ">mixed<" in first and "Scenes" not in first


def test_pages_are_written_whole_with_their_archive(tmp_path: Path) -> None:
    pages = {FIRST_PAGE: "<html>", "report/idea.html": "<p>"}
    target = write_report(tmp_path / "out", pages)
    assert target.read_text() == "<html>" and (tmp_path / "out" / "report" / "idea.html").read_text() == "<p>"
    assert sorted(path.name for path in target.parent.iterdir()) == ["report", "report.html", ARCHIVE_NAME]
    archive = target.parent / ARCHIVE_NAME
    with ZipFile(archive) as file:
        assert {name: file.read(name).decode() for name in file.namelist()} == pages
        assert {info.date_time for info in file.infolist()} == {(1980, 1, 1, 0, 0, 0)}  # or its bytes would not repeat
    first = archive.read_bytes()
    write_report(tmp_path / "out", pages)
    assert archive.read_bytes() == first


def test_pages_too_large_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ArgumentError, match="first page.*1000000"):
        write_report(tmp_path, {FIRST_PAGE: "x" * (LARGEST_FIRST + 1)})
    monkeypatch.setattr(report, "LARGEST_ARCHIVE", 200)
    with pytest.raises(ArgumentError, match="archive.*200"):
        write_report(tmp_path, {FIRST_PAGE: "", "report/idea.html": "".join(map(chr, range(32, 1000)))})
    assert list(tmp_path.iterdir()) == []


def test_the_first_page_maps_c10_start_by_start_and_says_where_to_stop() -> None:
    claim = CLAIMS["C10"]
    near, far = {"IAPB": 1e-5, "PB": 1e-4, "CBuc": 1e-4}, {"IAPB": 1e-3, "PB": 1e-4, "CBuc": 1e-4}
    rows = [start.row() | (near if start.tilt <= 0.015 else far) | {"coordinate": "x", "threshold": FULL}
            for start in full_grid()]  # fmt: skip
    found = claim.conclude(claim.table_of(rows))
    pile = dict.fromkeys(("contacts", "redundant", "time of (21)", "time of pushing"), 10.0)
    piles = [pile | {"rows": "touching", "most contacts that agree": 14, "contacts": contacts,
                     "median distance from the LCP": pulls, "pushing from the LCP": 1e-3 * pulls}
             for contacts, pulls in ((10, 0.0), (40, 0.25))]  # fmt: skip
    table = table_of([Column(key) for key in piles[0]], piles)
    topic = finding_of("complementarity", "Piles", "", "No.", (Part("n.", REFUTED),), {"piles": table})
    page = joined(Evidence(claims=(found,), topics=(topic,)))
    assert "IAPB is closest in 24 of 84 in x" in page and 'id="where-c10"' in page
    assert "where more than 14 contacts collide at once" in page and f"with complementarity to {prose('3e-04')}" in page
    fewer = replace(found, tables={"C10": found.tables["C10"].where(threshold="none")})
    assert 'id="where-c10"' not in joined(Evidence(claims=(fewer,)))


def test_each_page_lists_the_terms_that_it_uses_and_no_others(pages: dict[str, str]) -> None:
    """The wanted terms are those of the text without the list, and those of the meanings that this adds."""
    for name, page in pages.items():
        lists = re.findall(r'<details class="numbers terms">.*?</details>', page, flags=re.S)
        listed = [readable(term) for found in lists for term in re.findall(r"<dt>(.*?)</dt>", found)]
        wanted = terms_of(readable(re.sub(r'<details class="numbers terms">.*?</details>', " ", page, flags=re.S)))
        assert wanted == terms_of(readable(page)), name
        assert listed == [TERMS[form][0] for form in wanted], name
        assert len(lists) == bool(wanted) and "<!-- terms -->" not in page
    assert "worlds" in pages["report/couplings.html"] and "<dt>CBuc</dt>" in pages["report/couplings.html"]


def test_a_term_counts_where_a_reader_sees_it_and_brings_the_terms_of_its_meaning() -> None:
    hidden = '<head>CBuc</head><nav>patch</nav><script>"PB"</script><style>IAPB</style><p title="rank">impact</p>'
    assert terms_of(readable(hidden)) == () and explained(hidden + "<!-- terms -->") == hidden
    said = [TERMS[form][0] for form in terms_of("redundant contacts, IAPB-like, XPB")]
    assert said == ["row", "redundant"]


def test_every_term_of_the_list_is_used_in_the_report() -> None:
    """Its words occur in the sources from which the pages are made."""
    root = Path(report.__file__).parents[1]
    files = [path for folder in ("reports", "verification") for kind in ("*.py", "*.j2") for path in
             (root / folder).rglob(kind) if path.name != "terms.py"]  # fmt: skip
    text = " ".join(path.read_text(encoding="utf-8") for path in files)
    assert [form for form in TERMS if not re.search(rf"(?<![\w-])(?:{form})(?![\w-])", text)] == []


def test_a_figure_that_is_a_table_is_one_on_its_page() -> None:
    panel = Panel(grid(("a",), {"row": [Cell("x")]}), 'says "x"')
    recipe = Recipe("t", "", "A table", (), lambda _: Figure("t", "", "A table", "Look.", (panel,)), "accuracy")
    page = build_report(Evidence(), [recipe])["report/accuracy.html"]
    assert '<table aria-label="says &#34;x&#34;" class="grid' in page and "&lt;table" not in page
