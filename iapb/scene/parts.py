"""Common base of all parts of a scene: bounded numbers, names, and mistakes in terms of the scene
file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from iapb.errors import Mistake, shown
from iapb.names import hint, nearest

# SI units; products of four such numbers are far below the double overflow limit
LARGEST_NUMBER = 1e9
STIFFEST = 1e15  # [N/m, N s/m] of contacts: heavier loads than any scene's sag by less than 0.1 mm
# the inertia of a grain; positive values may be divisors: their square must not underflow
SMALLEST_POSITIVE = 1e-18

_FINITE = {"strict": True, "allow_inf_nan": False}
Number = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER, **_FINITE)]
Positive = Annotated[float, Field(ge=SMALLEST_POSITIVE, le=LARGEST_NUMBER, **_FINITE)]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST_NUMBER, **_FINITE)]
Gain = Annotated[float, Field(ge=0.0, le=STIFFEST, **_FINITE)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, **_FINITE)]
OwnRestitution = Annotated[
    Fraction | None,
    Field(
        description="its own e of (10) [1]; of two that touch the smaller counts; default: the other's, or contact's"
    ),
]
OwnFriction = Annotated[
    NonNegative | None,
    Field(
        description="its own mu [1]; of two that touch the geometric mean; default: the other's, or contact's"
    ),
]
Vector2 = tuple[Number, Number]
Vector3 = tuple[Number, Number, Number]
Truth = Annotated[bool, Field(strict=True)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,63}$", strict=True)]
SceneName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_.-]{0,63}$", strict=True)]
Text = Annotated[str, Field(max_length=2000, strict=True)]

Path = tuple[str | int, ...]  # of a value, such as ("bodies", 0, "mass")


def expectation(expected: str) -> PydanticCustomError:
    """Return the error for a field that breaks a rule of this project; its message says what was
    expected."""
    return PydanticCustomError("scene", "{expected}", {"expected": expected})


def require(holds: bool, expected: str) -> None:
    """Raise the error for a field that breaks a rule of this project."""
    if not holds:
        raise expectation(expected)


class _Missing:
    def __repr__(self) -> str:
        return "(missing)"


MISSING = _Missing()


def _is_short(error: Any) -> bool:
    return len(error["input"]) < int(error["ctx"]["min_length"])


class ScenePart(BaseModel):
    """A mapping of the scene file; it is immutable and has only the declared fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)

    @classmethod
    def across_fields(cls, given: Any) -> Iterable[tuple[Path, Any, str]]:
        """Return path, value and expectation of each mistake that concerns several fields
        together."""
        return ()

    @model_validator(mode="wrap")
    @classmethod
    def _all_at_once(cls, given: Any, validate: ModelWrapValidatorHandler[Self]) -> Self:
        """Report mistakes of single fields and across fields together, and say what was
        expected."""
        mistakes = [
            InitErrorDetails(type=expectation(expected), loc=path, input=value)
            for path, value, expected in cls.across_fields(given)
        ]
        try:
            part = validate(given)
        except ValidationError as failure:
            # a list also counts as too short if its invalid items were left out, and a default
            # that follows from other fields as wrong if one of these is
            mistakes += [
                cls._explained(error)
                for error in failure.errors(include_url=False)
                if error["type"] != "default_factory_not_called"
                and (error["type"] != "too_short" or _is_short(error))
            ]
        if mistakes:
            raise ValidationError.from_exception_data(cls.__name__, mistakes)
        return part

    @classmethod
    def _explained(cls, error: Any) -> InitErrorDetails:
        """Turn pydantic's error into one whose message says what was expected, in terms of the
        scene file."""
        kind = error["type"]
        where = error["loc"]
        words = error.get("ctx", {})
        expected = error["msg"]
        value = error["input"]
        if kind in _EXPECTED:
            expected = _EXPECTED[kind].format(**words)
            listed = re.findall("'([^']*)'", words.get("expected_tags", words.get("expected", "")))
            expected += hint(words.get("tag", value), listed)
        if kind == "extra_forbidden" and len(where) == 1:
            near = nearest(where[0], cls.model_fields)
            guess = f" (did you mean {near}?)" if near else ""
            expected = f"{KNOWN_FIELDS}{guess}: {', '.join(cls.model_fields)}"
        if kind == "missing":
            field = cls.model_fields.get(str(where[0])) if len(where) == 1 else None
            expected = f"this field: {field.description}" if field else "one item more in this list"
        if kind.startswith("union_tag"):
            where = (*where, "kind")
            value = value.get("kind")
        value = MISSING if kind in ("missing", "union_tag_not_found") else value
        return InitErrorDetails(type=expectation(expected), loc=where, input=value)


KNOWN_FIELDS = "one of the known fields"
_EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text",
    "finite_number": "a finite number",
    "greater_than_equal": "a number >= {ge}",
    "less_than_equal": "a number <= {le}",
    "string_pattern_mismatch": "a name: a letter or _, then up to 63 letters, digits, _ or -",
    "string_too_long": "a text of at most {max_length} characters",
    "literal_error": "one of {expected}",
    "tuple_type": "a list",
    "too_short": "at least {min_length} items",
    "too_long": "at most {max_length} items",
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type"), "a mapping of fields"),
    "union_tag_not_found": "this field: which shape it is",
    "union_tag_invalid": "one of {expected_tags}",
}

StandsAt = Callable[[Path, bool], tuple[int, int]]


def mistakes_of(
    failure: ValidationError, file: str, read: Any, place: StandsAt | None = None
) -> list[Mistake]:
    """Return pydantic's errors about the values `read` as mistakes.

    `place` maps a path, and whether its key is meant, to line and column; without it they are 0.
    """
    found = []
    for error in failure.errors(include_url=False):
        path: list[str | int] = []
        here = read
        for key in error["loc"]:
            if isinstance(here, dict) and key not in here and key == here.get("kind"):
                continue  # pydantic inserts the kind of a shape
            path.append(key)
            try:
                here = here[key]
            except (KeyError, IndexError, TypeError):
                here = MISSING
        default = here is MISSING and error["input"] is not MISSING
        value = shown(error["input"]) + (" (default)" if default else "")
        at = place(tuple(path), error["msg"].startswith(KNOWN_FIELDS)) if place else (0, 0)
        found.append(Mistake(file, *at, written(path), value, error["msg"]))
    return found


def written(path: Iterable[str | int]) -> str:
    """Return a path as it is written in messages, such as ``bodies[0].mass``."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return text.removeprefix(".") or "(file)"
