"""Study: the contents of a sweep file, its location, and its points. Reading reports all mistakes, as for a scene."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from iapb.errors import ArgumentError, Mistake, SceneError
from iapb.names import one_of
from iapb.scene import find_scene, scene_folder, scene_names
from iapb.scene.document import MAX_CHARACTERS, Document
from iapb.scene.parts import Name, Number, ScenePart, Text, mistakes_of
from iapb.scene.parts import Path as FieldPath

LAW = "law."  # paths below it are settings of the contact law
MAX_POINTS = 1_000_000  # files in one folder: a larger study is probably a mistake
MAX_VALUES = 100_000  # of one axis

Value = Annotated[Number | bool | Text | tuple[Number, ...], Field()]
Values = Annotated[tuple[Value, ...], Field(min_length=1, max_length=MAX_VALUES)]


class Range(ScenePart):
    """Values with equal differences or equal ratios."""

    start: Number = Field(alias="from", description="first value")
    stop: Number = Field(alias="to", description="last value")
    count: Annotated[int, Field(ge=2, le=MAX_VALUES, strict=True)] = Field(description="how many, both ends included")
    scale: Literal["linear", "log"] = Field("linear", description="equal steps, or equal factors")

    @classmethod
    def across_fields(cls, given: Any) -> Iterator[tuple[FieldPath, Any, str]]:
        ends = [given.get(name) for name in ("from", "to")] if isinstance(given, dict) else []
        positive = all(isinstance(end, int | float) and end > 0.0 for end in ends)
        if ends and given.get("scale") == "log" and not positive:
            yield ("scale",), "log", "linear where an end is not positive"

    def values(self) -> tuple[float, ...]:
        """Return the values; the first and the last are exact."""
        shares = [i / (self.count - 1) for i in range(self.count)]
        ratio = self.stop / self.start if self.scale == "log" else 1.0
        if self.scale == "linear":
            inner = [self.start + share * (self.stop - self.start) for share in shares]
        elif 0.0 < ratio < math.inf:
            inner = [self.start * math.exp(share * math.log(ratio)) for share in shares]
        else:  # the ratio of the ends overflows
            low, high = math.log(self.start), math.log(self.stop)
            inner = [math.exp((1.0 - share) * low + share * high) for share in shares]
        return (self.start, *inner[1:-1], self.stop)


class Span(ScenePart):
    """The interval of random values."""

    start: Number = Field(alias="from", description="least value")
    stop: Number = Field(alias="to", description="largest value")

    @classmethod
    def across_fields(cls, given: Any) -> Iterator[tuple[FieldPath, Any, str]]:
        start, stop = (given.get(name) for name in ("from", "to")) if isinstance(given, dict) else (None, None)
        if isinstance(start, int | float) and isinstance(stop, int | float) and start > stop:
            yield ("to",), stop, f"at least {start}, where it starts"


class Draws(ScenePart):
    """Random points: each value of a point is drawn from a uniform distribution on its interval."""

    count: Annotated[int, Field(ge=1, le=MAX_POINTS, strict=True)] = Field(description="how many points")
    seed: Annotated[int, Field(ge=0, le=2**63 - 1, strict=True)] = Field(0, description="of the random numbers")
    values: Annotated[dict[str, Span], Field(min_length=1)] = Field(description="value path: {from, to}")


class Study(ScenePart):
    """A sweep: every combination of the grid values and the random draws, in every world.

    Paths are those of a scene (``contact.stiffness``, ``bodies.peg.velocity.0``), or ``law.`` and a setting of the
    contact law (``law.integrator``).
    """

    name: Name = Field(description="the folder of the results")
    title: Text = Field("", description="one line for people")
    scene: Text = Field(description="name of a scene that comes with the project, or a file beside this one")
    worlds: Annotated[tuple[str, ...], Field(min_length=1, max_length=20)] = Field(("IAPB",), description="worlds")
    rendering: str = Field("full", description="how impulses meet the device's limits")
    values: dict[str, Value] = Field(default_factory=dict, description="values that hold at every point")
    grid: dict[str, Range | Values] = Field(default_factory=dict, description="value path: list, or {from, to, count}")
    random: Draws | None = Field(None, description="random draws; default: none")

    @property
    def size(self) -> int:
        """Return the number of points."""
        combinations = math.prod(len(values) for values in self.axes().values())
        return len(self.worlds) * combinations * (self.random.count if self.random else 1)

    def axes(self) -> dict[str, tuple[Any, ...]]:
        """Return the values of each axis of the grid."""
        return {path: axis.values() if isinstance(axis, Range) else axis for path, axis in self.grid.items()}


def load_study(path: str | Path) -> Study:
    """Read a study from a YAML file.

    Raises
    ------
    ArgumentError, SceneError
        The file cannot be read; it is not a study of at most MAX_POINTS points, with all mistakes.
    """
    try:
        with open(path, "rb") as file:
            text = file.read(4 * MAX_CHARACTERS + 1).decode("utf-8-sig")
    except (OSError, ValueError) as failure:
        raise ArgumentError("study", str(path), f"a readable file of text in UTF-8 ({failure})") from failure
    return study_from_text(text, str(path))


def study_from_text(text: str, file: str = "(text)") -> Study:
    """Read a study from YAML text; see `load_study`."""
    document = Document(text, file, "study")
    mistakes = document.mistakes
    try:
        study = Study.model_validate(document.value)
    except ValidationError as failure:
        raise SceneError(mistakes + mistakes_of(failure, file, document.value, document.place), "study") from failure
    if study.size > MAX_POINTS:
        mistakes.append(Mistake(file, 1, 1, "(file)", f"{study.size} points", f"at most {MAX_POINTS}"))
    if mistakes:
        raise SceneError(mistakes, "study")
    return study


def study_names() -> tuple[str, ...]:
    """Return the names of the studies that come with the project."""
    return tuple(sorted(path.stem for path in (scene_folder() / "sweeps").glob("*.yaml")))


def find_study(name: str) -> Path:
    """Return the study file that `name` means: a path, or the name of a study that comes with the project."""
    path, ours = Path(name), scene_folder() / "sweeps" / f"{name}.yaml"
    if path.is_file():
        return path
    if Path(name).name == name and ours.is_file():
        return ours
    raise ArgumentError("study", name, one_of(path.stem, study_names(), "a file, or one of: "))


def scene_of(study: Study, path: Path) -> Path:
    """Return the scene file of the study in a file: in its folder or below, or a scene that comes with the project.

    Raises
    ------
    ArgumentError
        The scene is in another place, or it does not exist.
    """
    folder = path.resolve().parent
    if study.scene in scene_names():
        beside = folder / study.scene
        return beside if beside.is_file() else find_scene(study.scene)
    given = Path(study.scene)
    if given.is_absolute() or ".." in given.parts or "\0" in study.scene:
        raise ArgumentError("scene", study.scene, "a path inside the study's folder, or the name of a scene of ours")
    try:
        found = (folder / given).resolve()
        here = found.is_relative_to(folder) and found.is_file()
    except (OSError, RuntimeError):  # a name too long for the system, or links in a circle
        here = False
    if not here:
        expected = one_of(given.stem, scene_names(), "a file beside the study, or one of: ")
        raise ArgumentError("scene", study.scene, expected)
    return found


@dataclass(frozen=True)
class Point:
    """One simulation of a sweep, as plain values that can be sent to another machine.

    scene : name or file path of the scene; values : values by scene path; law : settings of the law by name
    """

    index: int
    scene: str
    world: str
    rendering: str
    values: dict[str, Any]
    law: dict[str, Any]


def points_of(study: Study, scene: str) -> Iterator[Point]:
    """Yield the points; the outer loop is over the worlds, then over the grid axes in order, then over the draws."""
    axes, drawn = study.axes(), list(_draws(study.random)) if study.random else [{}]
    combinations = itertools.product(study.worlds, itertools.product(*axes.values()), drawn)
    for index, (world, chosen, draw) in enumerate(combinations):
        given = {**study.values, **dict(zip(axes, chosen, strict=True)), **draw}
        law = {path.removeprefix(LAW): value for path, value in given.items() if path.startswith(LAW)}
        values = {path: value for path, value in given.items() if not path.startswith(LAW)}
        yield Point(index, scene, world, study.rendering, values, law)


def _draws(random: Draws) -> Iterator[dict[str, float]]:
    """Yield the random values; each draw has its own generator, so additional draws do not change earlier ones."""
    for i in range(random.count):
        rng = np.random.default_rng([random.seed, i])
        yield {path: float(rng.uniform(span.start, span.stop)) for path, span in random.values.items()}
