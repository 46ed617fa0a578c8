"""Tables beside the code: YAML files with cases, scenes and numbers."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML


@cache
def data_of(module: str, name: str) -> Any:
    """Return the content of a file beside a module, given by its `__file__`."""
    return YAML(typ="safe").load(Path(module).with_name(name))
