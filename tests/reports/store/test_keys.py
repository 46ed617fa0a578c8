"""What a run key covers: every line of code that can change a number, and no comment."""

from __future__ import annotations

from pathlib import Path

import pytest

from iapb.errors import ArgumentError
from reports.store import keys

CODE = '''"""What it does."""
LIMIT = 3.0  # [N]

@njit
def force(x):
    """Return the force."""
    return 2.0 * x
'''


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("What it does.", "Does it."),
        ("Return the force.", "The force [N]."),
        ('    """Return the force."""\n', ""),
        ("  # [N]", "  # newton"),
        ("return 2.0 * x", "return (2.0\n            * x)"),
    ],
)
def test_words_do_not_enter_a_key(old: str, new: str) -> None:
    assert old in CODE
    assert keys.code_hash(CODE.replace(old, new).encode()) == keys.code_hash(CODE.encode())


@pytest.mark.parametrize(
    ("old", "new"),
    [("2.0", "2.5"), ("2.0 * x", "x * 2.0"), ("@njit\n", ""), ("LIMIT = 3.0", "LIMIT = 3"), ("(x)", "(x=\"a text\")")],
)
def test_code_does(old: str, new: str) -> None:
    assert old in CODE
    assert keys.code_hash(CODE.replace(old, new).encode()) != keys.code_hash(CODE.encode())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of sources, and a place of its own for what is remembered of them."""
    (tmp_path / "engine").mkdir()
    (tmp_path / "engine" / "a.py").write_text(CODE)
    monkeypatch.setattr(keys, "_ROOT", tmp_path)
    monkeypatch.setattr(keys, "__file__", str(tmp_path / "keys.py"))
    return tmp_path / "engine"


def version(folder: Path) -> str:
    return keys.sources_hash.__wrapped__(folder.name)


def test_a_file_that_is_changed_added_renamed_or_removed_changes_the_key(folder: Path) -> None:
    found = [version(folder)]
    (folder / "a.py").write_text(CODE.replace("2.0", "2.5"))
    found.append(version(folder))
    (folder / "b.py").write_text("")
    found.append(version(folder))
    (folder / "b.py").rename(folder / "c.py")
    found.append(version(folder))
    assert len(set(found)) == 4
    (folder / "c.py").unlink()
    (folder / "a.py").write_text(CODE.replace("Return", "Returns"))
    assert version(folder) == found[0]


@pytest.mark.parametrize("text", ["", "[1]", "{", '{"x": 1}'])
def test_what_is_remembered_saves_parsing_and_decides_nothing(
    folder: Path, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = version(folder)
    [kept] = folder.parent.rglob("code-*.json")
    kept.write_text(text)
    assert version(folder) == found
    with monkeypatch.context() as context:
        context.setattr(keys, "code_hash", lambda source: pytest.fail("parsed again"))
        assert version(folder) == found


def test_a_folder_without_sources_is_refused(folder: Path) -> None:
    """A folder that was renamed would otherwise leave every key."""
    (folder / "a.py").unlink()
    with pytest.raises(ArgumentError, match="engine"):
        version(folder)
