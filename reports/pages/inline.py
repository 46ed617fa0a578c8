"""The page's script, and its Content-Security-Policy: the browser runs only this script and makes no requests.

Without the script the page is complete: its curves cannot be read with a cursor, and its films play by themselves.
"""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files

from markupsafe import Markup


def script() -> Markup:
    """Return the text of the page's script, in a scope of its own."""
    text = files("reports.pages").joinpath("scripts/page.js").read_text(encoding="utf-8")
    return Markup("(() => {\n\"use strict\";\n" + text + "})();\n")


def policy(text: str) -> str:
    """Return the Content-Security-Policy of a page whose only script is `text`."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
