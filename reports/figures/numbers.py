"""Format numbers for readers: a true minus sign, superscript powers of ten, equal digits within a
column."""

from __future__ import annotations

import math
from typing import Any

MINUS = "\N{MINUS SIGN}"
DASH = "\N{EN DASH}"
TIMES = "\N{NARROW NO-BREAK SPACE}·\N{NARROW NO-BREAK SPACE}"  # a power of ten stays on its line
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# outside of this range a power of ten reads better than zeros
_PLAIN_FROM = 1e-3
_PLAIN_TO = 1e5


def format_number(value: float, digits: int = 4) -> str:
    """Return `value` with `digits` significant digits, as text for people (not for parsing)."""
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else ("∞" if value > 0 else f"{MINUS}∞")
    if value == 0.0:
        return "0"
    if _PLAIN_FROM <= abs(value) < _PLAIN_TO:
        decimals = digits - 1 - math.floor(math.log10(abs(value)))
        return f"{round(value, decimals):,.{max(decimals, 0)}f}".replace("-", MINUS)
    mantissa, exponent = f"{value:.{max(digits - 1, 0)}e}".split("e")
    if float(mantissa) == int(float(mantissa)):
        mantissa = str(int(float(mantissa)))
    power = f"10{str(int(exponent)).translate(_SUPERSCRIPTS)}"
    return power if mantissa == "1" else f"{mantissa.replace('-', MINUS)}{TIMES}{power}"


def power_of_ten(value: float) -> str:
    """Return 10 to the exponent of `value`, for the ticks of a logarithmic axis."""
    return f"10{str(round(math.log10(value))).translate(_SUPERSCRIPTS)}" if value > 0.0 else ""


def format_cell(value: Any, digits: int = 4) -> str:
    """Return a table cell: None is a dash, whole numbers stay whole, text stays as it is."""
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, int):
        return f"{value:,}".replace("-", MINUS)
    if isinstance(value, float):
        text = format_number(value, digits)
        return text.rstrip("0").rstrip(".") if "." in text and "·" not in text else text
    return str(value)


def is_number(value: Any) -> bool:
    """Return whether a cell is aligned to the right: it is a number, or None, which is printed as a
    dash."""
    return value is None or (hasattr(value, "__float__") and not isinstance(value, bool | str))
