"""The page's script, and its Content-Security-Policy: the browser runs only this script and makes no requests.

Each file of `scripts/` is written into the page, in the order below. Without the script the page is complete, but its
drawings are static.
"""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files

from markupsafe import Markup

SCRIPTS = ("plot.js", "traces.js", "player.js", "printing.js")


def script() -> Markup:
    """Return the text of the page's script; its files share one scope, which is hidden from other code."""
    folder = files("reports.pages").joinpath("scripts")
    parts = [folder.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS]
    return Markup("(() => {\n\"use strict\";\n" + "\n".join(parts) + "})();\n")


def policy(text: str) -> str:
    """Return the Content-Security-Policy of a page whose only script is `text`."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
