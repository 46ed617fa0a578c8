"""What each number of the page was made from, by runs, tables and commands; and what the page leaves to its files."""

from __future__ import annotations

from reports.figures.figure import Figure, Panel, Recipe
from reports.pages.builder import ROWS_SHOWN, badge_words
from reports.pages.records import Evidence, StoredFile
from reports.pages.sections import SECTIONS
from tests.reports.joined import joined
from verification.finding import MIXED, REFUTED, REPRODUCED, WHERE, Part, finding_of
from verification.hard_cases.study import finding_on
from verification.region import Region
from verification.table import titled

DETAILS = dict.fromkeys(("source", "kind", "why it is hard", "truth", "expected"), "said")
RUNS = tuple(
    StoredFile(f"run {n}", f"runs/{n}.h5", "k" * 64, f"{n:064d}", f"iapb run peg_corner --set rate={n}", 1000, ("C10",))
    for n in range(3)
)  # fmt: skip
KEPT = (StoredFile("claims", "tables/claims-1.h5", "k", "c" * 64, "iapb reproduce"),
        StoredFile("hard cases", "tables/hard_cases-1.h5", "k", "c" * 64, "iapb reproduce"))  # fmt: skip
CLAIMS = (finding_of("C10", "C10", "s", "h", (Part("p.", REPRODUCED),)),
          finding_of("C19", "C19", "s", "h", (Part("p.", REPRODUCED, timed=True),),
                     {"C19": titled(("a", "t"), ((1, 2.0),), timed=("t",))}))  # fmt: skip


def test_a_claim_names_its_runs_and_each_run_its_command():
    page = joined(Evidence(claims=CLAIMS, manifest=(*RUNS, *KEPT)), ())
    body = page.split('<details id="C10"')[1].split("</details>")[0]
    assert '<a href="manifest.html#runs-C10">3 runs</a>' in body
    listed = page.split('id="runs-C10"')[1].split("</details>")[0]
    assert all(run.file in listed and run.command in listed for run in RUNS)


def test_a_claim_without_runs_and_a_claim_on_times_say_so():
    page = joined(Evidence(claims=CLAIMS), ())
    body = page.split('<details id="C19"')[1]
    assert "keeps no runs; times are of the machine" in body


def test_a_section_names_the_files_its_numbers_are_kept_in():
    case = finding_on("bar", "bar", titled(("method", "outcome"), (("svd", "stable"),)), DETAILS)
    page = joined(Evidence(claims=CLAIMS, hard_cases=(case,), manifest=KEPT), ())
    assert "<code>tables/claims-1.h5</code>" in page.split('<section id="claims"')[1].split("</section>")[0]
    assert "<code>tables/hard_cases-1.h5</code>" in page.split('<section id="hard-cases"')[1].split("</section>")[0]


def test_a_figure_names_its_runs_and_the_command_that_draws_it():
    drawn = Figure("one", "", "t", "c", (Panel("<svg />", "alt"),), None, (), ("C10", "a table"))
    recipe = Recipe("one", "", "t", (), lambda inputs: drawn)
    page = joined(Evidence(manifest=RUNS), (recipe,))
    said = 'From <a href="manifest.html#runs-C10">C10</a>, a table. Again: <code>iapb reproduce --figure one</code>'
    assert said in page


def test_every_section_of_numbers_names_a_table():
    not_computed_by_a_stage = {"idea", "couplings", "provenance", "manifest"}
    assert {section.id for section in SECTIONS if not section.tables} == not_computed_by_a_stage


def test_a_long_table_is_cut_and_says_where_the_rest_is():
    rows = tuple((float(n),) for n in range(ROWS_SHOWN + 1))
    for shown, told in ((rows, True), (rows[:-1], False)):
        topic = finding_of("mechanics", "t", "l", "", (), {"trees": titled(("x",), shown)})
        page = joined(Evidence(topics=(topic,)), ())
        assert (f"The first {ROWS_SHOWN} of {ROWS_SHOWN + 1} lines" in page) == told
        assert page.count('<tr><th scope="row" class="n">') == ROWS_SHOWN


def test_the_first_page_shows_every_part_of_a_claim_with_its_count():
    held = [Part("s.", REPRODUCED, f"part {n}", 5, 5) for n in range(9)]
    worst = Part("s.", REFUTED, "the one that fails", 1, 40, 7)
    where = Part("s.", WHERE, "part in a region", 30, 40, region=Region((("tilt", "rad", None, 0.015),), share=0.05))
    page = joined(Evidence(claims=(finding_of("C20", "C20", "s", "a", [*held, where, worst]),)), ())
    first = page.split('<section id="verdict"')[1].split("</section>")[0]
    assert all(part.name in first for part in held)
    assert "reproduced where tilt ≤ 0.015 rad" in first and "30 of 40; the region is 5% of the tested range" in first
    line = first.split(">the one that fails")[1].split("</li>")[0]
    assert "refuted" in line and "1 of 40, 7 cannot tell" in line
    assert "1 refuted" in page.split("11 parts:")[1].split("</p>")[0]
    assert "more" not in first.split('<ul class="parts">')[1]


def test_a_topic_with_failing_findings_counts_them():
    topic = finding_of("mechanics", "t", "l", "v", (Part("a", REPRODUCED), Part("b", REFUTED)))
    assert badge_words(topic) == "1 of 2 findings fail"
    assert badge_words(finding_of("proofs", "t", "l", "v", (Part("a", REFUTED),))) == "fails"
    assert badge_words(finding_of("proofs", "t", "l", "v", (Part("a", MIXED),))) == "mixed"
