"""Run: the record of one simulation, and the definition of every recorded array.

All evaluation after the simulation uses a Run alone. Each recorded array has its dimensions, unit
and meaning in its field definition below. The loop's record (`iapb.recording`), the run file
(`reports.store.schema`) and the test of docs/notation.md use these definitions. States are sampled
at n + 1 instants (dimension time); step quantities belong to the n steps between them. The
dimension velocity has the d generalized velocities, and device_velocity has those of the tool in
the hand (and of the device, which has the same kinematics).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from hashlib import blake2b
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import name_the_extra
from iapb.lazy import extension, needed
from iapb.numerics.schema import Booleans, Floats, Integers, Quantity, States, quantities

# contact states of the paper, section III
FREE = 0
COLLIDING = 1
RESTING = 2
# begins a remark
UNSOLVED = "resting contact was not solved to rounding, and velocities were shortened"
STATE_NAMES = ("free", "colliding", "resting")
INTERRUPTED = "interrupted"  # value of `Run.stopped` after Ctrl-C
_SHOWN = 12  # most coordinates that a plot or a table shows

# Units of generalized quantities follow the unit of their coordinate or of their velocity.
POSITION = {"m": "m", "rad": "rad", "1": "1"}
# "1": an impact of plain numbers without units, not from a scene.
VELOCITY = {"m/s": "m/s", "rad/s": "rad/s", "1": "1"}
FORCE = {"m/s": "N", "rad/s": "N m", "1": "1"}
IMPULSE = {"m/s": "N s", "rad/s": "N m s", "1": "1"}


@dataclass(frozen=True)
class ContactTable:
    """Contacts of all steps. The rows ``offsets[k]:offsets[k + 1]`` are the contacts of step k."""

    offsets: Annotated[
        Integers,
        "step_edge",
        "1",
        "first row of each step's contacts; the last entry closes",
    ]
    body_a: Annotated[Integers, "contact", "1", "moving body that the normal points into"]
    body_b: Annotated[Integers, "contact", "1", "other body, -1 = the static world"]
    point: Annotated[
        Floats,
        "contact axis",
        "m",
        "contact point, world axes; with an impulse: where it struck",
    ]
    normal: Annotated[Floats, "contact axis", "1", "unit normal, from b into a"]
    gap: Annotated[Floats, "contact", "m", "distance, negative = overlap"]
    normal_velocity: Annotated[
        Floats, "contact", "m/s", "before the step's impulse, positive separates"
    ]
    normal_force: Annotated[Floats, "contact", "N", "force on a along the normal"]
    friction_force: Annotated[Floats, "contact axis", "N", "friction force on a"]
    # the one of least norm if it is not unique
    impulse: Annotated[Floats, "contact", "N s", "collision impulse on a along the normal"]
    is_new: Annotated[
        Booleans, "contact", "1", "1 where the contact was not there in the step before"
    ]


@dataclass(frozen=True)
class ImpactTable:
    """Resolved impacts: one row per step and island of a colliding group (paper section V).

    An island is a set of trees connected by contacts of the impact. A tree that merely touches them
    is not in it.
    """

    step: Annotated[Integers, "impact", "1", "step in which it happened"]
    group: Annotated[Integers, "impact", "1", "first tree of those resolved together"]
    v_minus: Annotated[Floats, "impact velocity", VELOCITY, "generalized velocity before"]
    v_plus: Annotated[Floats, "impact velocity", VELOCITY, "generalized velocity after"]
    impulse: Annotated[Floats, "impact velocity", IMPULSE, "generalized impulse"]
    rows: Annotated[Integers, "impact", "1", "rows given to the resolver"]
    rank: Annotated[Integers, "impact", "1", "rows it found independent and used"]
    energy_lost: Annotated[Floats, "impact", "J", "kinetic energy before minus after"]
    scale: Annotated[Floats, "impact", "1", "factor by which the device limit scaled the impulse"]
    clamp: Annotated[Floats, "impact", "1", "factor of the final energy clamp"]
    friction_share: Annotated[
        Floats, "impact", "1", "factor by which friction was reduced (energy, cones)"
    ]
    approaching: Annotated[
        Integers,
        "impact",
        "1",
        "rows that approach still afterwards, -1 = the law does not say",
    ]
    solved: Annotated[
        Booleans,
        "impact",
        "1",
        "0 where the law is not met (friction reduced); passive all the same",
    ]
    mass_digest: Annotated[
        Integers,
        "impact",
        "1",
        "first 8 bytes of BLAKE2b of M made again from the recorded q, as a signed integer",
    ]
    time: Annotated[
        Floats, "impact", "s", "when it happened, in its step: at its start or at a touch"
    ]
    q: Annotated[Floats, "impact coordinate", POSITION, "configuration at that time"]


# column of ImpactTable that is made after the run
MADE_AFTERWARDS = ("mass_digest",)


def digests(matrices: Floats) -> Integers:
    """Return the `mass_digest` of each of n matrices (n, d, d)."""
    plain = np.ascontiguousarray(matrices, "<f8")
    return np.array(
        [
            int.from_bytes(blake2b(one.tobytes(), digest_size=8).digest(), "little", signed=True)
            for one in plain
        ],
        np.int64,
    )


@dataclass(frozen=True)
class EffectRow:
    """One line of the effects table: whether the effect was on, and why. `ignores`: field that the
    law ignored."""

    name: str
    active: bool
    reason: str
    ignores: str = ""


class Later(NamedTuple):
    """A function of the run that computes an attribute at its first use."""

    value: Callable[[Run], Any]


@dataclass(frozen=True, repr=False)
class Run:
    """One simulation: scene, law, coupling and all recorded quantities (SI units).

    Derived quantities (`pose`, `energy`, `distrust`, the text of scene and effects) are computed at
    first use.
    """

    scene_name: str
    scene_source: str  # YAML text
    scene_resolved: dict[str, Any]  # every field with its value, defaults included
    world: str  # "IAPB", "PB", "ideal", "CBuc" or a name that the caller chose
    law: str
    law_settings: dict[str, Any]
    coupling: str  # "none" without a device
    coupling_settings: dict[str, Any]
    dt: float  # [s]
    complete: bool  # False if stopped early; the arrays then end at the last step done
    coordinate_names: tuple[str, ...]  # (nq,)
    coordinate_units: tuple[str, ...]  # (nq,)
    velocity_names: tuple[str, ...]  # (d,), also for generalized forces and impulses
    # (d,) m/s or rad/s; forces have N or N m, impulses N s or N m s
    velocity_units: tuple[str, ...]
    body_names: tuple[str, ...]
    tool_dofs: tuple[int, int]  # start, stop of the tool in v; (0, 0) without a hand
    # start, stop of the tool in q: a quaternion has more entries than its velocity
    tool_coordinates: tuple[int, int]

    time: Floats  # (n + 1,) [s]
    q: Annotated[Floats, "time coordinate", POSITION, "generalized configuration"]
    v: Annotated[Floats, "time velocity", VELOCITY, "generalized velocity"]
    device_q: Annotated[Floats, "time device_coordinate", POSITION, "configuration of the device"]
    device_v: Annotated[Floats, "time device_velocity", VELOCITY, "velocity of the device"]
    # of each body's frame: x, y, angle in (−π, π] in the plane; x, y, z and a quaternion x, y, z, w
    # >= 0 in space
    pose: Annotated[Floats, "time body placement", POSITION, "where each body is"]

    hand_force: Annotated[
        Floats, "step velocity", FORCE, "generalized force of the hand on the tool"
    ]
    coupling_force: Annotated[Floats, "step velocity", FORCE, "force of the coupling on the tool"]
    penalty_force: Annotated[
        Floats, "step velocity", FORCE, "normal contact forces, or constraint forces"
    ]
    friction_force: Annotated[Floats, "step velocity", FORCE, "friction forces"]
    impulse: Annotated[
        Floats, "step velocity", IMPULSE, "generalized collision impulse of the step"
    ]
    environment_force: Annotated[
        Floats, "step velocity", FORCE, "contact forces + impulse / dt (26)"
    ]
    device_force: Annotated[
        Floats, "step device_velocity", FORCE, "what the device's actuators apply"
    ]
    state: Annotated[States, "step", "1", "contact state of the tool's group"]
    contacts: ContactTable
    impacts: ImpactTable
    energy: dict[str, Floats]  # the ledger, see iapb.mechanics.energy
    effects: tuple[EffectRow, ...]

    chunk_steps: Annotated[Integers, "chunk", "1", "steps per timed chunk"] = field(
        default_factory=lambda: np.zeros(0, np.int64)
    )
    chunk_seconds: Annotated[Floats, "chunk", "s", "wall time of each chunk"] = field(
        default_factory=lambda: np.zeros(0)
    )
    kernel: str = "compiled"  # or "python"
    stopped: str = ""  # why an incomplete run was stopped; empty for a complete one
    remarks: tuple[str, ...] = ()  # remarks on values chosen for the scene
    # why the result is not to be trusted (`iapb.advice.distrust`); empty if nothing is wrong
    # no default of the class, which would hide a Later
    distrust: tuple[str, ...] = field(default_factory=tuple)
    # N: of a long run, every N-th step is recorded, and each step with an impact (`iapb.thinning`)
    every: int = 1

    def __post_init__(self) -> None:
        """Set the attributes aside that are computed at first use."""
        later = {name: value for name, value in vars(self).items() if isinstance(value, Later)}
        for name in later:
            del vars(self)[name]
        vars(self)["_later"] = later

    def __getattr__(self, name: str) -> Any:
        """Compute an attribute at its first use."""
        later = vars(self).get("_later", {}).get(name)
        if later is None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return vars(self).setdefault(name, later.value(self))

    def __getstate__(self) -> dict[str, Any]:
        """Return all attributes, computed, for pickle and copies."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @property
    def steps(self) -> int:
        """Number of steps recorded."""
        return len(self.time) - 1

    @property
    def steps_done(self) -> int:
        """Number of steps done; more than those recorded if the record is thinned."""
        return self.steps if self.every == 1 else round(float(self.time[-1]) / self.dt)

    @property
    def records_contacts(self) -> bool:
        """Whether contacts and forces are recorded; another engine gives states alone
        (`iapb.engines`)."""
        return len(self.state) == self.steps

    def __repr__(self) -> str:
        """Return the summary, and the first reason for distrust if there is one."""
        return (
            f"<Run of {self.summary}>"
            if not self.distrust
            else (f"<Run of {self.summary}\n not to be trusted, because {self.distrust[0]}>")
        )

    @property
    def summary(self) -> str:
        """Scene, world, steps, impacts and penetration on one line."""
        end = "" if self.complete else f", stopped: {self.stopped}"
        kept = "" if self.every == 1 else f" ({self.steps} recorded)"
        done = f"{self.scene_name} in {self.world}: {self.steps_done} steps of {1e3 * self.dt:.4g} ms{kept}{end}"
        if not self.records_contacts:
            return f"{done}, contacts not recorded"
        deepest = max(0.0, -float(self.contacts.gap.min(initial=0.0)))
        return (
            f"{done}, {len(self.impacts.step)} impacts, penetration at most {1e3 * deepest:.3g} mm"
        )

    def to_xarray(self) -> Any:
        """Return everything recorded as one `xarray.Dataset`, with units and labelled dimensions.

        Arrays of contacts and impacts have the prefixes ``contact_`` and ``impact_``; energies have
        ``energy_``.
        """
        xarray = needed("xarray", "Run.to_xarray")
        listed = [
            (record, prefix, each)
            for record, prefix in (
                (self, ""),
                (self.contacts, "contact_"),
                (self.impacts, "impact_"),
            )
            for each in quantities(type(record))
            if each.dimensions[0] != "step" or self.records_contacts
        ]
        variables = {
            prefix + each.name: (
                each.dimensions,
                getattr(record, each.name),
                {"units": unit_of(each, self), "long_name": each.meaning},
            )
            for record, prefix, each in listed
        }
        variables |= {
            f"energy_{name}": ((energy_dimension(self, name),), values, {"units": "J"})
            for name, values in self.energy.items()
        }
        sizes = {
            name: length
            for dimensions, values, _ in variables.values()
            for name, length in zip(dimensions, values.shape, strict=True)
        }
        labels = {
            name: list(coordinates_of(self, name, length)[0]) for name, length in sizes.items()
        }
        heading = {
            name: getattr(self, name) for name in ("scene_name", "world", "law", "coupling", "dt")
        }
        return xarray.Dataset(variables, labels, {**heading, "distrust": "; ".join(self.distrust)})

    def plot(self) -> Any:
        """Draw coordinates, energy and the deepest contact over time; return the matplotlib
        figure."""
        figure = needed("matplotlib.figure", "Run.plot").Figure(
            figsize=(8.0, 7.0), layout="constrained"
        )
        places, energy, *depth = figure.subplots(2 + self.records_contacts, 1, sharex=True)
        for i, name in enumerate(self.coordinate_names[:_SHOWN]):
            places.plot(self.time, self.q[:, i], label=f"{name} [{self.coordinate_units[i]}]")
        for name in ("kinetic", "potential"):
            if name in self.energy:
                energy.plot(self.time, self.energy[name], label=name)
        deepest = np.zeros(self.steps)
        np.maximum.at(
            deepest,
            np.repeat(np.arange(self.steps), np.diff(self.contacts.offsets)),
            -self.contacts.gap,
        )
        for axes in depth:
            axes.plot(self.time[:-1], 1e3 * deepest, label="deepest contact")
        drawn = [places, energy, *depth]
        for axes, label in zip(
            drawn, ("coordinates", "energy [J]", "penetration [mm]"), strict=False
        ):
            axes.set_ylabel(label)
            axes.legend(loc="best", fontsize="small")
        drawn[-1].set_xlabel("time [s]")
        figure.suptitle(
            f"{self.scene_name} in {self.world}" + (" (not to be trusted)" if self.distrust else "")
        )
        return figure

    def save(self, path: Any, *, replace: bool = False) -> Any:
        """Write the run as one HDF5 file, as `iapb run` does; `reports.store.read_run` reads it
        back.

        Parameters
        ----------
        path : path of the file
        replace : whether to replace an existing file; otherwise the file is left unchanged

        Returns
        -------
        Path
        """
        try:
            return extension("iapb.files", "write")(path, self, replace=replace)
        except ModuleNotFoundError as error:
            raise name_the_extra(error, "Run.save") from error


# Labels of the arrays of a run, for its file and for `Run.to_xarray`


def energy_dimension(run: Run, name: str) -> str:
    """Return the dimension of an energy array: ``time`` if it has n + 1 values, ``step`` if it has
    n."""
    length = len(run.energy[name])
    return {run.steps + 1: "time", run.steps: "step"}.get(length, f"{name}_entry")


def unit_of(quantity: Quantity, run: Run) -> str:
    """Return the unit of `quantity` in `run`: one unit, or one per column if the columns differ."""
    if isinstance(quantity.unit, str):
        return quantity.unit
    units = [quantity.unit[unit] for unit in _labels_along(run, quantity.dimensions[-1])[1]]
    return units[0] if len(set(units)) == 1 else ", ".join(units) or "1"


def coordinates_of(
    run: Run, dimension: str, length: int
) -> tuple[NDArray[Any] | tuple[str, ...], str]:
    """Return the values along a dimension and their unit: labels, instants, or 0, 1, 2 …"""
    if dimension == "time":
        return np.asarray(run.time, np.float64), "s"
    labels, _ = _labels_along(run, dimension)
    if labels and len(labels) == length:
        return labels, "1"
    return np.arange(length, dtype=np.int64), "1"


def _labels_along(run: Run, dimension: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units along a dimension; both are empty for dimensions without labels."""
    q = slice(*run.tool_coordinates)
    v = slice(*run.tool_dofs)
    planar = run.pose.shape[-1] == 3
    return {
        "coordinate": (run.coordinate_names, run.coordinate_units),
        "velocity": (run.velocity_names, run.velocity_units),
        "device_coordinate": (run.coordinate_names[q], run.coordinate_units[q]),
        "device_velocity": (run.velocity_names[v], run.velocity_units[v]),
        "body": (run.body_names, ()),
        "axis": (("x", "y", "z"), ()),
        "placement": (
            ("x", "y", "angle") if planar else ("x", "y", "z", "qx", "qy", "qz", "qw"),
            ("m", "m", "rad") if planar else ("m", "m", "m", "1", "1", "1", "1"),
        ),
    }.get(dimension, ((), ()))
