"""The pages: whole, self-contained, honest about what is missing, and of one voice."""

import base64
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from iapb.errors import ArgumentError
from reports.figures.figure import Figure, Panel, cell, grid
from reports.figures.paper import arm_energies
from reports.pages.builder import (
    FIRST_PAGE,
    ROWS_SHOWN,
    badge_words,
    build_report,
    draw_all,
    link_across,
    worst_first,
)
from reports.pages.first import LIMIT, facts, made_from
from reports.pages.formulas import prose
from reports.pages.records import Evidence
from reports.pages.sections import SECTIONS
from reports.pages.terms import TERMS, explained, readable, terms_of
from reports.report import LARGEST_FIRST, write_report
from reports.uses import StoredFile
from verification import finding
from verification.claims import CLAIMS
from verification.claims.conditions import FULL_GRID
from verification.claims.peg import ALL_THREE, LARGE
from verification.finding import MIXED, NOT_COMPUTED, REFUTED, REPRODUCED, Part, finding_of
from verification.hard_cases.findings import NOT_TRIED, STABLE, finding_on, on_hard_cases
from verification.laws.topic import counterexample, properties
from verification.region import Region
from verification.table import table_from, titled

VOID = {"meta", "link", "br", "img", "input", "hr"}
RUNS = tuple(
    StoredFile(f"{n}.h5", f"{n:064d}", f"iapb run peg_corner --set rate={n}", ("C10",))
    for n in range(3)
)


class Outline(HTMLParser):
    """What the tests ask of a page: identifiers, links, and tags that were not closed."""

    def __init__(self, page):
        super().__init__()
        self.ids, self.links, self.open, self.wrong = [], [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids += [given["id"]] if given.get("id") else []
        self.links += [given[name] for name in ("href", "src", "xlink:href") if given.get(name)]
        self.open += [tag] if tag not in VOID else []

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.open = self.open[: -1 if tag not in VOID else None]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def joined(evidence):
    """Every page as one text, the first page first, for tests that ask what is said and not
    where."""
    return "\n".join(build_report(evidence).values())


def one(key, *parts, said="a", **more):
    return finding_of(key, key, "q", said, parts, **more)


def hard_case(*rows):
    numbers = titled(("method", "outcome", "forward error"), rows)
    details = {
        "source": "ours",
        "kind": "impact",
        "why it is hard": "$0.5$ J",
        "truth": "exact",
        "expected": "no gain",
    }
    return finding_on("bar", "bar", numbers, details)


LAW = {
    "law": "KE",
    "cases": 10,
    "worst": 0.0,
    "bound": 1.0,
    "holds": True,
    "fault": "sign",
    "fault caught": True,
}
EVIDENCE = Evidence(
    inputs={"arm_energies": arm_energies()},
    claims=(
        finding_of(
            "C01",
            "C01",
            "KE never rises <b>",
            "half of the printed loss: $\\frac{1}{2}$",
            (Part("as printed.", MIXED, "as printed"),),
            {"C01": titled(("κ", "gain"), ((1e3, 2e-16),))},
        ),
        one("C02", Part("n.", REFUTED)),
        one("C10", Part("p.", REPRODUCED)),
    ),
    hard_cases=(hard_case(("factored", "stable", 1e-16)),),
    counterexamples=(
        counterexample("gram_pinv", "no gain", "It gains.", {"e": 0.5}, "assert gain <= 0"),
        counterexample("saturate", "passive", "It gains too.", {"M": [[1]]}),
    ),
    topics=(
        one(
            "properties",
            Part("It never rises.", REPRODUCED),
            tables={"laws": properties.checks[0].table_of([LAW])},
        ),
        finding_of(
            "mechanics",
            "Linkages",
            "Asked <here>.",
            "All hold.",
            (Part("It holds to 1e-14.", REPRODUCED),),
            {"trees": titled(("joints", "error"), ((3, 1e-14),))},
        ),
    ),
    effects={
        "peg": titled(
            ("effect", "active", "reason", "left out", "cost", "change"),
            [("gravity", False, "none in the scene", "", None, None)],
        )
    },
    provenance={"commit": "abc"},
    runs=RUNS,
)


@pytest.fixture(scope="module", params=[Evidence(), EVIDENCE], ids=["empty", "full"])
def pages(request):
    made, again = (build_report(request.param, draw_all(request.param)) for _ in range(2))
    assert made == again  # byte for byte
    return made


def test_each_page_is_well_formed_asks_for_nothing_and_runs_only_its_own_script(pages):
    assert list(pages) == [FIRST_PAGE, *(section.page for section in SECTIONS)]
    outlines = {name.rpartition("/")[2]: Outline(page) for name, page in pages.items()}
    for name, page in pages.items():
        outline = outlines[name.rpartition("/")[2]]
        assert (outline.wrong, outline.open) == ([], []) and len(outline.ids) == len(
            set(outline.ids)
        )
        for link in set(outline.links) - {"data:,"}:
            file, mark, anchor = link.partition("#")
            assert not mark or anchor in outlines[(file or name).rpartition("/")[2]].ids, (
                name,
                link,
            )
            assert (
                not file or (Path(name).parent / file).as_posix().replace("report/../", "") in pages
            )
        assert all(
            f"{section.id}.html#{section.id}" in page
            for section in SECTIONS
            if section.page != name
        )
        (script,) = re.findall(r"<script>(.*?)</script>", page, flags=re.S)
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"script-src &#39;sha256-{digest}&#39;" in page
        assert not re.search(
            r"\son\w+=|fetch\(|XMLHttpRequest|import\(|eval\(|@import|url\((?!#)", page
        )


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


def test_what_was_not_computed_is_said():
    empty = [section for section in SECTIONS if not section.ready(Evidence())]
    assert joined(Evidence()).count('<p class="absent">Not computed in this run.</p>') == len(empty)
    assert not any(
        "reproduced" in part.split("<body>")[1] for part in build_report(Evidence()).values()
    )
    assert facts(Evidence()) == () and made_from(Evidence()) == ""


def test_the_pages_say_what_the_records_say_escaped_counted_and_with_their_sources():
    page = " ".join(joined(EVIDENCE).split())
    for text in (
        "KE never rises &lt;b&gt;",
        "<mfrac>",
        "1 holds for some quantities and fails for",
        "; 1 fails.",
        "Fails in some trials<",
        "Asked &lt;here&gt;.",
        "It holds to 10<sup>−14</sup>.",
        "<summary>Trees</summary>",
        "<code>assert gain &lt;= 0</code>",
        '<th scope="row">e</th><td><code>0.5</code>',
        "[[1]]",
        "<dd>3 runs</dd>",
        "keeps no runs",
        "each of the 3 runs",
    ):
        assert text in page, text


def test_hard_cases_are_seen_at_a_glance_the_engines_failures_first_and_a_refusal_is_no_number():
    case = hard_case(
        ("factored", "stable", 1e-16), ("gram", "refused", None), ("damped", NOT_TRIED, None)
    )
    page = joined(Evidence(hard_cases=(case,)))
    for text in (
        '<span class="good">✓</span>&nbsp;factored: stable',
        '<span class="bad">✕</span>&nbsp;gram: refused',
        '<span class="open">○</span>&nbsp;damped: not tried',
        "1 of 2 stable",
    ):
        assert text in page, text
    stiff = replace(hard_case(("IAPB", "gains energy", 0.5)), title="stiff wall")
    found = on_hard_cases((hard_case(("IAPB", "stable", 0.0)), stiff))
    assert (
        found.verdict == MIXED
        and "1 of 2" in found.answer
        and "“stiff wall” (gains energy)" in found.answer
    )
    assert found.parts[0].miss == "1 of 2 hard cases fails: “stiff wall” (gains energy)"
    calm, others, ours = (
        finding_on(
            name,
            name,
            table_from(
                [{"method": "factored", "outcome": own}, {"method": "svd", "outcome": other}]
            ),
            {},
        )
        for name, own, other in (
            ("calm", STABLE, STABLE),
            ("others", STABLE, "refused"),
            ("ours", "wrong motion", STABLE),
        )
    )
    assert worst_first([calm, others, ours]) == [ours, others, calm]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("at most 2.0e-16 of it", "at most 2.0 · 10<sup>−16</sup> of it"),
        ("1e8", "10<sup>8</sup>"),
        ("0.0e+00", "0"),
        ("-3e+00", "−3"),
        ("e in [-1, 1]", "e in [−1, 1]"),
        ("2005-06", "2005-06"),
        ("key a1e5b", "key a1e5b"),
        ("p >= 0 <= q", "p ≥ 0 ≤ q"),
        ("costs 5$ <i>", "costs 5$ &lt;i&gt;"),
    ],
)
def test_powers_of_ten_read_as_people_write_them(text, shown):
    assert str(prose(text)).replace("\u202f", " ") == shown


def test_a_figure_names_its_runs_and_the_command_that_draws_it_and_a_table_is_a_table():
    panel = Panel(grid(("a",), {"row": [cell("x")]}), 'says "x"')
    drawn = Figure(
        "t", "", "A table", "Look.", (panel,), None, (), ("C10", "a table"), section="accuracy"
    )
    page = build_report(Evidence(runs=RUNS), [drawn])
    assert '<table aria-label="says &#34;x&#34;" class="grid' in page["report/accuracy.html"]
    said = "Data: C10, a table. To compute it again: <code>iapb reproduce --fig"
    assert said in page["report/accuracy.html"] and "&lt;table" not in page["report/accuracy.html"]
    rows = tuple((float(n),) for n in range(ROWS_SHOWN + 1))
    for shown, told in (
        (rows, True),
        (rows[:-1], False),
    ):  # a long table is cut, and says where the rest is
        page = joined(Evidence(topics=(one("mechanics", tables={"trees": titled(("x",), shown)}),)))
        assert (f"The first {ROWS_SHOWN} of {ROWS_SHOWN + 1} lines" in page) == told
        assert page.count('<tr><th scope="row" class="n">') == ROWS_SHOWN


def test_pages_are_written_whole_and_a_too_large_first_page_is_refused(tmp_path):
    target = write_report(tmp_path / "out", {FIRST_PAGE: "<html>", "report/idea.html": "<p>"})
    assert (
        target.read_text() == "<html>"
        and (tmp_path / "out" / "report" / "idea.html").read_text() == "<p>"
    )
    assert sorted(path.name for path in target.parent.iterdir()) == ["report", "report.html"]
    with pytest.raises(ArgumentError, match="first page.*1000000"):
        write_report(tmp_path / "new", {FIRST_PAGE: "x" * (LARGEST_FIRST + 1)})
    assert not (tmp_path / "new").exists()


def test_each_page_lists_the_terms_that_it_uses_and_no_others(pages):
    """The wanted terms are those of the text without the list, and those of the meanings that this
    adds."""
    for name, page in pages.items():
        lists = re.findall(r'<details class="numbers terms">.*?</details>', page, flags=re.S)
        listed = [
            readable(term) for found in lists for term in re.findall(r"<dt>(.*?)</dt>", found)
        ]
        wanted = terms_of(
            readable(re.sub(r'<details class="numbers terms">.*?</details>', " ", page, flags=re.S))
        )
        assert wanted == terms_of(readable(page)) and listed == [
            TERMS[form][0] for form in wanted
        ], name
    hidden = '<head>CBuc</head><nav>patch</nav><script>"PB"</script><style>IAPB</style><p title="rank">energy</p>'
    assert terms_of(readable(hidden)) == () and explained(hidden + "<!-- terms -->") == hidden
    assert [TERMS[form][0] for form in terms_of("rank of contacts, IAPB-like, XPB")] == [
        "row",
        "rank",
    ]


# The first page


def test_the_first_page_shows_every_part_of_a_claim_with_its_count_and_every_topic_with_an_answer():
    held = [Part("s.", REPRODUCED, f"part {n}", 5, 5) for n in range(9)]
    worst = Part("s.", REFUTED, "the one that fails", 1, 40, 7, named="a quantity")
    printed = Part("s.", REFUTED, "formula", role=finding.MISPRINT)
    ours = Part("s.", REFUTED, "more", role=finding.BEYOND)
    region = Region((("tilt", "rad", None, 0.015),), share=0.05)
    where = Part("s.", finding.WHERE, "part in a region", 30, 40, region=region)
    topics = (
        one("mechanics", Part("a", REPRODUCED), Part("b", REFUTED), said="Most hold."),
        one("engines", said=""),
    )
    page = joined(Evidence(claims=(one("C20", *held, where, worst, printed, ours),), topics=topics))
    first = page.split('<section id="verdict"')[1].split("</section>")[0]
    assert (
        all(part.name in first for part in held)
        and "Most hold." in first
        and "engines" not in first
    )
    for text in (
        "holds where tilt ≤ 0.015 rad",
        "over all conditions 30 of 40</span>",
        "fails, as printed",
        "fails (beyond the paper)",
        "Fails in a quantity<",
        "1 of 40 (7 more cannot tell)",
    ):
        assert text in first, text
    assert "125 trials (tested conditions) decide; 7 more" in page
    assert (
        badge_words(topics[0]) == "1 of 2 findings fails"
        and badge_words(one("p", Part("a", REFUTED))) == "fails"
    )


def c10(parts, lost=0):
    """Claim C10 from made-up distances: IAPB is nearest up to a tilt of 0.015 rad, but for the
    first `lost`."""
    near, far = ({"IAPB": ours, "PB": 1e-4, "CBuc": 1e-4} for ours in (1e-5, 1e-3))
    small = [(start, part) for start in FULL_GRID for part in parts if start.tilt <= 0.015]
    rows = [
        start.row()
        | (near if (start, part) in small[lost:] else far)
        | {"coordinate": part, "part": part, "ideal settles": start.tilt < 0.05}
        for start in FULL_GRID
        for part in parts
    ]
    return CLAIMS["C10"].conclude(CLAIMS["C10"].table_of(rows))


def told(*claims, topics=()):
    """The lines of the first screen by label."""
    return {fact.label: fact.text for fact in facts(Evidence(claims=claims, topics=topics))}


def test_the_answer_is_made_from_the_claims():
    rows = (
        (LARGE, "x", 10.0, 1.0),
        (LARGE, "y", 6.0, 2.0),
        (LARGE, "x", 8.0, 1.0),
        (LARGE, "rotation", 1.0, 1.0),
    )
    forces = one("C11", tables={"C11": titled(("part", "coordinate", "IAPB", "PB"), rows)})
    clipped = (
        (0.3, "x", 1.0, 1.0),
        (1.0, "x", 4.0, 1.0),
        (1.0, "y", 2.0, 1.0),
        (1.0, "rotation", 9.0, 1.0),
    )
    table = titled(("force_limit", "coordinate", "IAPB", "PB"), clipped).judged(lambda row: True)
    x, turned = (
        Part("s.", finding.WHERE, "x", 40, 40),
        Part("s.", REFUTED, "rotation", 1, 40, named="rotation"),
    )
    ours = Part("s.", REFUTED, "x, larger", 0, 9, role=finding.BEYOND)
    said = told(one("C10", x, turned, ours), forces, one("C14", tables={"C14": table}))
    assert (
        "8 times as large on a device without force limit (median of 3 values), and 3 times"
        in said["Holds"]
    )
    assert (
        "in 40 of 40 starts for x, 1 of 40 starts for rotation." in said["Fails"]
        and "of 9" not in said["Fails"]
    )
    assert "this holds in 40 of 40 starts for x." in told(one("C10", x, ours))["Holds"]


def test_the_first_page_maps_c10_and_small_tilts_hold_only_if_every_start_that_can_tell_does():
    found = c10("x")
    assert (
        "does not settle within the run from 48 of 84 starts (tilts from 0.05 rad on)"
        in found.answer
    )
    page = joined(Evidence(claims=(found,)))
    assert "IAPB is nearest in 24 of 84 in x" in page and 'id="where-c10"' in page
    fewer = replace(found, tables={"C10": found.tables["C10"].where(part="none")})
    assert 'id="where-c10"' not in joined(Evidence(claims=(fewer,)))
    for lost, label in ((0, "Holds"), (1, "Fails")):
        said = told(c10(("x", "y", ALL_THREE), lost))
        for text in ("up to 0.86° (0.015 rad; 24 starts)", f"in {24 - lost} of 24 starts for x"):
            assert text in said[label]


def test_the_first_screen_names_our_failures_the_gravest_first_and_what_was_not_computed():
    def topic(key, verdict, *misses):
        return one(key, Part("p.", verdict), *(Part("q.", verdict, miss=miss) for miss in misses))

    found = told(topics=(topic("exact-energy", REPRODUCED), topic("haptic-rate", NOT_COMPUTED)))
    assert found["Energy of impacts"] == f"a {LIMIT}" and "Is it fast?" not in found
    assert found["Known failures"] == "Not computed: haptic-rate."
    given = (
        "haptic-rate",
        "mechanics",
        "stability",
        "complementarity",
        "hard-cases",
        "exact-energy",
    )
    topics = (
        *(topic(key, MIXED, f"miss of {key}", "more") for key in given),
        topic("engines", MIXED),
    )
    (fact,) = (fact for fact in facts(Evidence(topics=topics)) if fact.label == "Known failures")
    assert [id for _, id in fact.items] == [
        *given[:-3:-1],
        *given[3:0:-1],
        given[0],
    ]  # engines: not our failure
    assert fact.items[0] == (
        "Miss of exact-energy (1 more on the page exact-energy)",
        "exact-energy",
    )


def test_the_time_of_a_step_is_on_the_first_page():
    steps = table_from([{"scene": "peg_corner", "step [µs]": 0.4444}])
    rate = one("haptic-rate", Part("p.", MIXED), said="14 of 18 speed targets met.")
    evidence = Evidence(topics=(rate,), inputs={"effect_steps": steps})
    said = "A time step of the peg in the corner takes 0.44 µs; a loop at 1 kHz allows 1000 µs. 14 of 18"
    assert said in build_report(evidence)[FIRST_PAGE]
