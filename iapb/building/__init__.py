"""Make the engine's library: needed when the package is built, never to use it."""

from __future__ import annotations
