"""What a run key covers: every input, every line of code that can change a number, and no comment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb.errors import ArgumentError
from reports.store import keys, run_key

INPUTS = {"scene": {"name": "peg", "rate": 512}, "law": "IAPB", "settings": {"restitution": np.float64(0.0)}}
CODE = '''"""What it does."""
LIMIT = 3.0  # [N]

@njit
def force(x):
    """Return the force."""
    return 2.0 * x
'''


def test_every_input_and_the_code_enter_the_key_but_not_order_and_type() -> None:
    changed = [INPUTS, INPUTS | {"law": "PB"}, INPUTS | {"scene": {"name": "peg", "rate": 1000}},
               INPUTS | {"settings": {"restitution": 5e-324}}, INPUTS | {"extra": None}]  # fmt: skip
    assert len({run_key(inputs) for inputs in changed} | {run_key(INPUTS, code="mine")}) == len(changed) + 1
    reordered = {"settings": {"restitution": 0.0}, "law": "IAPB", "scene": {"rate": 512, "name": "peg"}}
    assert run_key(reordered) == run_key(INPUTS)
    with pytest.raises(ArgumentError, match="value"):
        run_key({"law": object()})


@pytest.mark.parametrize(("old", "new", "same"), [
    ("What it does.", "Does it.", True), ('    """Return the force."""\n', "", True), ("  # [N]", "", True),
    ("return 2.0 * x", "return (2.0\n            * x)", True), ("2.0", "2.5", False), ("2.0 * x", "x * 2.0", False),
    ("@njit\n", "", False), ("LIMIT = 3.0", "LIMIT = 3", False), ("(x)", '(x="a text")', False),
])  # fmt: skip
def test_code_enters_a_key_and_words_do_not(old: str, new: str, same: bool) -> None:
    assert old in CODE
    assert (keys.code_hash(CODE.replace(old, new).encode()) == keys.code_hash(CODE.encode())) is same


def test_a_changed_added_or_removed_file_changes_the_key_whatever_is_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keys, "_ROOT", tmp_path)
    monkeypatch.setattr(keys, "__file__", str(tmp_path / "keys.py"))
    folder = tmp_path / "engine"
    folder.mkdir()
    with pytest.raises(ArgumentError, match="engine"):  # renamed, it would otherwise leave every key
        keys.sources_hash.__wrapped__("engine")

    def version(**files: str) -> str:
        for name, text in files.items():
            (folder / f"{name}.py").write_text(text)
        return str(keys.sources_hash.__wrapped__("engine"))

    first = version(a=CODE)
    found = [first, version(a=CODE.replace("2.0", "2.5")), version(b="")]
    (folder / "b.py").rename(folder / "c.py")
    assert len({*found, version()}) == 4
    (folder / "c.py").unlink()
    [kept] = tmp_path.rglob("code-*.json")
    for text in ("", "[1]", "{", '{"x": 1}'):
        kept.write_text(text)
        assert version(a=CODE.replace("Return", "Returns")) == first
    monkeypatch.setattr(keys, "code_hash", lambda source: pytest.fail("parsed again"))
    assert version() == first
