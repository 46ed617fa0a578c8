"""Every statement is proved, its twins are refuted, and its printed and MathML forms can be made."""


import pytest

from iapb.errors import ArgumentError
from verification.proofs import all_proofs, check


@pytest.mark.parametrize("name", all_proofs())
def test_statement_is_proved(name: str) -> None:
    record = check(name)
    assert record.problems == ()
    assert record.holds
    assert record.twins, "a statement without a wrong twin shows nothing"
    assert all(refutation.refuted for refutation in (*record.twins, *record.needed))


@pytest.mark.parametrize("name", all_proofs())
def test_printed_proof_lists_every_hypothesis_and_certificate_line(name: str) -> None:
    record = check(name)
    text = record.as_text()
    assert "\\" not in text, "LaTeX that a terminal cannot show"
    for line in (*record.hypotheses, *(row for step in record.steps for row in step.certificate)):
        assert line.words in text
        assert line.text in text


def test_unknown_name_is_refused() -> None:
    with pytest.raises(ArgumentError, match="theorem_1"):
        check("theorem_0")
