"""Every statement is proved, its twins are refuted, and its printed form lists all of it."""

import pytest

from verification.proofs import all_proofs, check


@pytest.mark.parametrize("name", all_proofs())
def test_statement_is_proved_and_printed(name: str) -> None:
    record = check(name)
    assert record.problems == () and record.holds and record.sympy == "yes"
    assert record.twins, "a statement without a wrong twin shows nothing"
    assert all(refutation.refuted for refutation in (*record.twins, *record.needed))
    text = record.as_text()
    assert "\\" not in text, "LaTeX that a terminal cannot show"
    for line in (
        *record.sections["HYPOTHESES"],
        *(row for step in record.steps for row in step.products),
    ):
        assert line in text
