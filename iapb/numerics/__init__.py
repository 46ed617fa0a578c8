"""Arithmetic of the kernels, how they are compiled and called, and the arrays that they share."""

from __future__ import annotations
