"""Common base of all parts of a scene: bounded numbers, names, and mistakes in terms of the scene file."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from iapb.errors import Mistake, shown
from iapb.names import nearest

LARGEST_NUMBER = 1e9  # SI units; products of four such numbers are far below the double overflow limit
SMALLEST_POSITIVE = 1e-12  # positive values may be divisors; their inverse square must not overflow

_FINITE = {"strict": True, "allow_inf_nan": False}
Number = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER, **_FINITE)]
Positive = Annotated[float, Field(ge=SMALLEST_POSITIVE, le=LARGEST_NUMBER, **_FINITE)]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST_NUMBER, **_FINITE)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, **_FINITE)]
OwnRestitution = Annotated[
    Fraction | None,
    Field(
        description="its own e of (10) [1]; of two that touch the smaller counts; default: the other's, or contact's"
    ),
]
OwnFriction = Annotated[
    NonNegative | None,
    Field(description="its own mu [1]; of two that touch the geometric mean; default: the other's, or contact's"),
]
Vector2 = tuple[Number, Number]
Vector3 = tuple[Number, Number, Number]
Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,63}$", strict=True)]
Text = Annotated[str, Field(max_length=2000, strict=True)]


OURS, MISSING = "scene", "scene_missing"  # error types of this project; their message says what was expected


def expectation(expected: str, kind: str = OURS) -> PydanticCustomError:
    """Return the error for a field that breaks a rule of this project; its message says what was expected."""
    return PydanticCustomError(kind, "{expected}", {"expected": expected})


def located(where: tuple[str | int, ...], value: Any, expected: str, kind: str = OURS) -> InitErrorDetails:
    """Return one mistake at a path, for a check across several fields."""
    return InitErrorDetails(type=expectation(expected, kind), loc=where, input=value)


class Part(BaseModel):
    """A mapping of the scene file; it is immutable and has only the declared fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)

    @classmethod
    def across_fields(cls, given: Any) -> list[InitErrorDetails]:
        """Return the mistakes that concern several fields together."""
        return []

    @model_validator(mode="wrap")
    @classmethod
    def _all_at_once(cls, given: Any, validate: ModelWrapValidatorHandler[Self]) -> Self:
        """Report mistakes of single fields and across fields together; for an unknown field, list the known ones."""
        mistakes: list[InitErrorDetails] = []
        try:
            part = validate(given)
        except ValidationError as failure:
            mistakes = [
                cls._readable(error)
                for error in failure.errors(include_url=False)
                if not _follows_from_others(error)
            ]
        mistakes += cls.across_fields(given)
        if mistakes:
            raise ValidationError.from_exception_data(cls.__name__, mistakes)
        return part

    @classmethod
    def _readable(cls, error: Any) -> InitErrorDetails:
        """Turn pydantic's error into one whose message says what was expected."""
        where, kind, value, expected = error["loc"], error["type"], error["input"], error["msg"]
        if kind not in (OURS, MISSING):
            expected = expected_of(error)
        if kind == "extra_forbidden" and len(where) == 1:
            expected = _known_fields(str(where[0]), tuple(cls.model_fields))
        if kind == "missing":
            field = cls.model_fields.get(str(where[0])) if len(where) == 1 else None
            expected = f"this field: {field.description}" if field else "one item more in this list"
        if kind == "union_tag_not_found":
            where, kind = (*where, "kind"), MISSING
        if kind == "union_tag_invalid":
            where, value = (*where, "kind"), value["kind"]
        return located(where, value, expected, MISSING if kind in ("missing", MISSING) else OURS)


def _known_fields(wrong: str, known: tuple[str, ...]) -> str:
    near = nearest(wrong, known)
    guess = f" (did you mean {near}?)" if near else ""
    return f"one of the known fields{guess}: {', '.join(known)}"


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
    "model_type": "a mapping of fields",
    "model_attributes_type": "a mapping of fields",
    "dict_type": "a mapping of fields",
    "union_tag_not_found": "this field: which shape it is",
    "union_tag_invalid": "one of {expected_tags}",
}


def expected_of(error: Any) -> str:
    """Return what was expected, in terms of the scene file."""
    template = _EXPECTED.get(error["type"])
    if template is None:
        return str(error["msg"])
    return template.format(**error.get("ctx", {})) + _guess(error)


def _guess(error: Any) -> str:
    """Return a hint with the similar word, if one of a few words was expected and one is similar."""
    words = error.get("ctx", {})
    listed = re.findall("'([^']*)'", words.get("expected_tags", words.get("expected", "")))
    near = nearest(words.get("tag", error["input"]), listed) if listed else ""
    return f"; did you mean {near}?" if near else ""


def _follows_from_others(error: Any) -> bool:
    """Return whether a list counts as too short only because its invalid items were left out."""
    given = error["input"]
    return error["type"] == "too_short" and len(given) >= error["ctx"]["min_length"]


# Mistakes with their place in the file

Place = tuple[str | int, ...]
StandsAt = Callable[[Place, bool], tuple[int, int]]  # path, whether its key is meant -> line and column


def mistakes_of(failure: ValidationError, file: str, read: Any, stands_at: StandsAt | None = None) -> list[Mistake]:
    """Return pydantic's errors about the values `read` as mistakes; the line is 0 without `stands_at`."""
    return [_mistake(error, file, read, stands_at) for error in failure.errors(include_url=False)]


def _mistake(error: Any, file: str, read: Any, stands_at: StandsAt | None) -> Mistake:
    path, exists = _field_path(error["loc"], read)
    missing = error["type"] == MISSING
    value = "(missing)" if missing else shown(error["input"]) + ("" if exists else " (default)")
    line, column = stands_at(path, error["msg"].startswith("one of the known fields")) if stands_at else (0, 0)
    return Mistake(file, line, column, written(path), value, error["msg"])


def _field_path(where: Place, read: Any) -> tuple[Place, bool]:
    """Return the path in the file, without the shape kinds that pydantic inserts, and whether it exists there."""
    path: list[str | int] = []
    exists = True
    for key in where:
        if isinstance(read, dict) and key not in read and key == read.get("kind"):
            continue
        path.append(key)
        try:
            read = read[key]
        except (KeyError, IndexError, TypeError):
            read, exists = None, False
    return tuple(path), exists


def written(path: Place) -> str:
    """Return a path as it is written in messages, such as ``bodies[0].mass``."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text or "(file)"
