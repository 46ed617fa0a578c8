"""The pages: whole, self-contained, honest about what is missing, and of one voice."""

import re
from pathlib import Path

import pytest
from jinja2 import UndefinedError

from iapb.errors import ArgumentError
from reports.figures.figure import Figure, Panel
from reports.pages.builder import ROWS_SHOWN, _environment, build_report, draw_all, link_across
from reports.pages.cells import by_agreement, method_map
from reports.pages.crate import CRATE_NAME
from reports.pages.formulas import prose
from reports.pages.numbers import ABSENT, num, numbers_of, percent, time, times
from reports.pages.numbers_file import NUMBERS_NAME
from reports.pages.page import FIRST_PAGE, PAGES
from reports.pages.records import Evidence
from reports.pages.report import LARGEST_FIRST, write_report
from tests.reports.made_up import EVIDENCE, RUNS, one
from verification.numbers import value_tables
from verification.table import titled


def joined(evidence):
    """Every page as one text, the first page first, for tests that ask what is said and not
    where."""
    return "\n".join(build_report(evidence).values())


@pytest.fixture(scope="module", params=[Evidence(), EVIDENCE], ids=["empty", "full"])
def pages(request):
    made, again = (build_report(request.param, draw_all(request.param)) for _ in range(2))
    assert made == again  # byte for byte
    return made


def test_each_page_is_well_formed_asks_for_nothing_and_runs_no_script(pages):
    assert list(pages) == [page.file for page in PAGES] and len(pages) == 10
    ids = {name: re.findall(r'\sid="([^"]+)"', page) for name, page in pages.items()}
    for name, page in pages.items():
        for tag in ("table", "div", "details", "figure", "section", "ul", "p", "svg", "main"):
            opened = re.findall(rf"<{tag}[\s>]", page)
            assert len(opened) == page.count(f"</{tag}>"), (name, tag)
        assert len(ids[name]) == len(set(ids[name]))
        for link in set(re.findall(r'(?:href|src)="([^"]+)"', page)) - {"data:,"}:
            file, mark, anchor = link.partition("#")
            beside = (Path(name).parent / file).as_posix().replace("report/../", "")
            target = beside if file else name
            assert target in (*pages, NUMBERS_NAME, CRATE_NAME)
            assert not mark or anchor in ids[target], link
        head = page.split("<main")[0]
        assert all(f"#{other.id}" in head for other in PAGES)
        assert "<script" not in page and "default-src 'none'" in head
        assert not re.search(r"\son\w+=|@import|url\((?!#)", page)


def test_a_link_to_an_id_of_no_page_is_an_error():
    given = {
        "a.html": '<a href="#x">',
        "report/b.html": '<p id="x"><a href="#x"><a href="#y">',
        "c.html": '<p id="y">',
    }
    assert link_across(given) == {
        "a.html": '<a href="report/b.html#x">',
        "c.html": '<p id="y">',
        "report/b.html": '<p id="x"><a href="#x"><a href="../c.html#y">',
    }
    with pytest.raises(KeyError, match="z"):
        link_across({"a.html": '<a href="#z">'})


def test_a_page_quotes_numbers_by_key_and_a_missing_one_is_an_error_or_says_not_computed():
    tables = value_tables({"impacts": 130846, "gain": 3e-14}, {"step_us": 1500.0})
    evidence = Evidence(topics=(one("exact-energy", tables=tables),))
    numbers = numbers_of(evidence, ("exact-energy", "speed"))

    def rendered(text):
        return _environment().from_string(text).render(numbers=numbers)

    quoted = "{{ numbers.exact_energy.impacts | num }} {{ numbers.exact_energy.step_us | time }}"
    assert rendered(quoted) == "130,846 1.5\u202fms"
    assert rendered("{{ numbers.speed.any | num }}{{ numbers.speed.any > 3 }}") == f"{ABSENT}False"
    for wrong in ("numbers.exact_energy.impact | num", "numbers.speeds.any"):
        with pytest.raises(UndefinedError):
            rendered(f"{{{{ {wrong} }}}}")


def test_numbers_have_one_format():
    assert [num(32.47), num(0.554), num(1296.3), num(1296.0), num(3e-14), num(1e-9)] == [
        "32",
        "0.55",
        "1,300",
        "1,296",
        "3\u202f·\u202f10⁻¹⁴",
        "10⁻⁹",
    ]
    assert [time(0.5512), time(1234.0), time(2.5e6)] == [
        "0.551\u202fµs",
        "1.23\u202fms",
        "2.5\u202fs",
    ]
    assert (percent(0.131), times(11.2)) == ("13\u202f%", "11×")


def test_the_pages_show_the_records_escaped_and_counted():
    page = " ".join(joined(EVIDENCE).split())
    for text in (
        "KE never rises &lt;b&gt;",
        "Asked &lt;here&gt;.",
        "the position changes by up to 2.5 mm",
    ):
        assert text in page, text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("at most 2.0e-16 of it", "at most 2.0 · 10<sup>−16</sup> of it"),
        ("e in [-1, 1]", "e in [−1, 1]"),
        ("2005-06", "2005-06"),
        ("costs 5$ <i>", "costs 5$ &lt;i&gt;"),
    ],
)
def test_powers_of_ten_read_as_people_write_them(text, shown):
    assert str(prose(text)).replace("\u202f", " ") == shown


def test_methods_are_mapped_with_failures_of_the_engine_first_and_agreement_falls():
    rows = [
        ("a", "impact", "factored", "stable"),
        ("b", "impact", "factored", "stable"),
        ("b", "impact", "svd", "failed"),
        ("c 1e-6", "impact", "factored", "wrong motion"),
        ("m", "motion", "IAPB", "stable"),
    ]
    found = method_map(titled(("case", "kind", "method", "outcome"), rows), "impact")
    assert (found.methods, found.cases, found.easy) == (["factored", "svd"], 3, 1)
    assert list(found.hard) == ["c 10⁻⁶", "b"] and found.right == {"factored": "2/3", "svd": "0/1"}
    assert found.tried == {"factored"}  # what no easy case tried is not called stable
    columns = ("impacts", "kind", "cases", "agree", "differ")
    kinds = titled(columns, [("a", "scene", 4, 1, 3), ("b", "scene", 4, 3, 1), ("c", "x", 1, 1, 0)])
    assert [(row["impacts"], row["share"]) for row in by_agreement(kinds, "scene")] == [
        ("b", 0.75),
        ("a", 0.25),
    ]


def test_a_figure_names_its_runs_and_the_command_that_draws_it_and_a_long_table_is_cut():
    panel = Panel("<svg ></svg>", 'says "x"')
    drawn = Figure("fig07", "", "A curve", "Look.", (panel,), None, (), ("C10", "a table"))
    page = build_report(Evidence(runs=RUNS), [drawn])["report/figures.html"]
    assert "says &#34;x&#34;" in page and "&lt;svg" not in page
    assert "Data: C10, a table. To compute it again: <code>iapb reproduce --fig" in page
    rows = tuple((float(n),) for n in range(ROWS_SHOWN + 1))
    page = joined(Evidence(topics=(one("stability", tables={"trees": titled(("x",), rows)}),)))
    assert page.count('<tr><th scope="row" class="n">') == ROWS_SHOWN


def test_pages_are_written_whole_and_a_too_large_first_page_is_refused(tmp_path):
    target = write_report(tmp_path / "out", {FIRST_PAGE: "<html>", "report/idea.html": "<p>"})
    assert target.read_text() == "<html>"
    assert (tmp_path / "out" / "report" / "idea.html").read_text() == "<p>"
    assert sorted(path.name for path in target.parent.iterdir()) == ["report", "report.html"]
    with pytest.raises(ArgumentError, match=f"first page.*{LARGEST_FIRST}"):
        write_report(tmp_path / "new", {FIRST_PAGE: "x" * (LARGEST_FIRST + 1)})
    assert not (tmp_path / "new").exists()
