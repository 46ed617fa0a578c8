"""The last result of fuzzing and of fault injection, in last_result.json beside this file: the report shows it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

PATH = Path(__file__).with_suffix(".json")


def remember(part: str, command: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Replace one part: its table, the command that makes it, the day and the commit."""
    commit = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True,
                            cwd=PATH.parent).stdout.strip()  # fmt: skip
    parts = json.loads(PATH.read_text(encoding="utf-8")) if PATH.is_file() else {}
    parts[part] = {"command": command, "date": f"{datetime.now(UTC):%Y-%m-%d}", "commit": commit,
                   "columns": list(columns), "rows": [list(row) for row in rows]}  # fmt: skip
    PATH.write_text(json.dumps(parts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
