"""Every block of the documents is performed; what they show is what comes out.

`IAPB_UPDATE_DOCS=1 pytest tests/docs` writes the outputs of today into the documents instead.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import Any

import pytest
from blocks import ROOT, Block, read_blocks
from comparing import differs

UPDATE = bool(os.environ.get("IAPB_UPDATE_DOCS"))
DOCUMENTS = ("README.md", "docs/scenes.md", "docs/resolvers.md", "docs/tutorial.md", "docs/extending.md")
BLOCKS = [(k, block) for name in DOCUMENTS for k, block in enumerate(read_blocks(ROOT / name, name))]


@pytest.mark.parametrize(("number", "block"), BLOCKS, ids=[block.id for _, block in BLOCKS])
def test_block(number: int, block: Block, answers_of: Callable[[str], list[dict[str, Any]]]) -> None:
    answer = answers_of(block.document)[number]
    assert not answer["failure"], f"{block.id}\n{answer['failure']}"
    if block.expected is not None and not UPDATE:
        difference = differs(answer["output"], block.expected)
        assert not difference, f"{block.id}: {difference}\n\n{answer['output']}"


@pytest.mark.parametrize("name", DOCUMENTS)
def test_make_targets_exist(name: str) -> None:
    makefile = (ROOT / "Makefile").read_text()
    for block in read_blocks(ROOT / name, name):
        for target in re.findall(r"^make (\w+)", block.source, flags=re.M) if block.kind == "sh" else ():
            assert re.search(rf"^{target}:", makefile, flags=re.M), f"{block.id}: no make target {target!r}"


if UPDATE:

    @pytest.mark.parametrize("name", DOCUMENTS)
    def test_update(name: str, answers_of: Callable[[str], list[dict[str, Any]]]) -> None:
        """Write today's outputs into the document, from the last block to the first; shortened ones ("…") stay."""
        path = ROOT / name
        lines = path.read_text(encoding="utf-8").splitlines()
        pairs = list(zip(read_blocks(path, name), answers_of(name), strict=True))
        for block, answer in reversed(pairs):
            if block.expected is not None and "…" not in block.expected:
                first, last = block.expected_lines
                lines[first:last] = [line.rstrip() for line in answer["output"].strip("\n").splitlines()]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
