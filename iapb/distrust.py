"""Check the record of a run for signs of a meaningless result: energy, overlap, tunnelling and positions."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.joints import KINDS
from iapb.mechanics.rotations import rotation_of
from iapb.names import in_metres
from iapb.run import Run

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

UNACCOUNTED = 0.02  # share of the available energy that errors of a first-order step may add
DEEP = 0.5  # of the thinner shape: largest overlap of rigid bodies
NARROW = 0.1  # of the body: a rigid body cannot pass a gap that is narrower by so much
OVERRUN = 0.1  # of a joint's range: largest distance beyond a limit at the end
ROUNDED = 1e-9  # rounding error of a crossing, as a share of the step
WILD = 10.0  # factor on the farthest distance that start, speed and acceleration explain


def distrust_of(run: Run) -> tuple[str, ...]:
    """Return the reasons why a result is not to be trusted, from the record alone; empty if nothing is wrong."""
    if not (np.isfinite(run.q).all() and np.isfinite(run.v).all()):
        return ("positions or velocities are not finite",)
    return tuple(found for found in (_made_energy(run), _friction_drove(run), _sank(run), _passed(run), _squeezed(run),
                                   _flew(run), _overran(run)) if found)


def _in_springs(run: Run) -> float:
    """Energy in springs at the start [J]."""
    touching = run.contacts.gap[int(run.contacts.offsets[0]) : int(run.contacts.offsets[1])] if run.steps else ()
    if not len(touching):
        return 0.0
    stiffness = run.scene_resolved.get("contact", {}).get("stiffness", 0.0)
    return float(0.5 * stiffness * float(np.sum(np.minimum(touching, 0.0) ** 2)))


def _at_hand(run: Run) -> float:
    """Return the energy available to the run [J]: start, springs, loss of height, and work of hand and coupling."""
    energy = run.energy
    fallen = float(energy["potential"][0] - energy["potential"].min())
    worked = sum(float(np.abs(energy[name]).max(initial=0.0)) for name in ("hand_work", "coupling_work"))
    return float(energy["kinetic"][0]) + _in_springs(run) + fallen + worked


def _made_energy(run: Run) -> str:
    """Say where the energy exceeds the energy at the start plus the work done."""
    energy = run.energy
    if not {"kinetic", "potential", "hand_work", "coupling_work"} <= set(energy) or not run.steps:
        return ""
    total = energy["kinetic"] + energy["potential"]
    allowed = total[0] + _in_springs(run) + energy["hand_work"] + energy["coupling_work"]
    excess = total[1:] - allowed
    k = int(np.argmax(excess))
    if excess[k] <= 0.0 or excess[k] <= UNACCOUNTED * _at_hand(run) + _trifle(run):
        return ""
    return (f"its energy is {excess[k]:.3g} J above start and work at {run.time[k + 1]:.4g} s, where these are "
            f"{_at_hand(run):.3g} J")


def _trifle(run: Run) -> float:
    """Return a negligible energy [J]: that of lifting the bodies by a thousandth of their size."""
    gravity = float(np.linalg.norm(run.scene_resolved.get("gravity") or [0.0]))
    return 1e-3 * gravity * sum(body.get("mass", 0.0) * _size(body.get("shapes", ()), 0.0)
                                for body in run.scene_resolved.get("bodies", ()))


def _friction_drove(run: Run) -> str:
    """Say if friction did positive work on the bodies."""
    work = run.energy.get("friction_work")
    if work is None or not len(work) or not {"hand_work", "coupling_work"} <= set(run.energy):
        return ""
    most = float(work.max())
    if most <= 0.0 or most <= UNACCOUNTED * _at_hand(run) + _trifle(run):
        return ""
    return f"friction drove the bodies, by {most:.3g} J"


def _size(shapes: Iterable[dict[str, Any]], without: float = math.inf) -> float:
    """Return the smallest extent [m] of shapes given as plain values; `without` if none has an extent."""
    sizes = []
    for shape in shapes:
        if "radius" in shape:
            sizes.append(2.0 * shape["radius"])
        elif "size" in shape:
            sizes.append(min(shape["size"]))
        elif "vertices" in shape:
            sizes.append(float(np.ptp(np.array(shape["vertices"]), axis=0).min()))
    return min(sizes, default=without)


def _sank(run: Run) -> str:
    """Say where two bodies overlap by more than half of the thinner shape."""
    bodies = run.scene_resolved.get("bodies", [])
    if not len(run.contacts.gap) or len(bodies) != len(run.body_names):
        return ""
    sizes = np.array([*(_size(body.get("shapes", ())) for body in bodies), math.inf])  # the world is -1, the last
    if run.contacts.gap.min() >= -DEEP * sizes.min():
        return ""
    thinner = np.minimum(sizes[run.contacts.body_a], sizes[run.contacts.body_b])
    i = int(np.argmin(run.contacts.gap / thinner))
    if -run.contacts.gap[i] <= DEEP * thinner[i]:
        return ""
    k = int(np.searchsorted(run.contacts.offsets, i, "right")) - 1
    a, b = (run.body_names[x] if x >= 0 else "a wall" for x in (run.contacts.body_a[i], run.contacts.body_b[i]))
    b += " (or the limit of its joint)" if bodies[run.contacts.body_a[i]].get("joint_limits") else ""
    return (f"{a} and {b} overlap by {in_metres(-float(run.contacts.gap[i]))} at {run.time[k]:.4g} s, more than half "
            f"of {in_metres(float(thinner[i]))}")


def _passed(run: Run) -> str:
    """Return a sentence on a ball or circle whose centre enters and leaves a flat-faced wall in one step, or ""."""
    scene = run.scene_resolved
    walls = [(wall["name"], *_faces(wall)) for wall in scene.get("walls", ()) if "size" in wall or "vertices" in wall]
    if not walls or not run.steps or len(scene.get("bodies", ())) != len(run.body_names):
        return ""
    for b, body in enumerate(scene["bodies"]):
        for shape in body.get("shapes", ()):
            if "radius" not in shape:
                continue
            center = _carried(run.pose[:, b], np.array(shape["center"], np.float64))
            for wall, normals, offsets in walls:
                k = _crossed(center @ normals.T - offsets)
                if k >= 0:
                    return f"{run.body_names[b]} passes through {wall} in the step to {run.time[k + 1]:.4g} s"
    return ""


def _faces(wall: dict[str, Any]) -> tuple[Floats, Floats]:
    """Return the unit outward normals (e, dim) and offsets (e,) of a box or polygon; n·x <= offset inside."""
    if "size" in wall:
        dim = len(wall["size"])
        normals = np.vstack([np.eye(dim), -np.eye(dim)])
        offsets = 0.5 * np.array([*wall["size"], *wall["size"]])
    else:
        corners = np.array(wall["vertices"], np.float64)
        edges = np.roll(corners, -1, axis=0) - corners
        normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.hypot(edges[:, 0], edges[:, 1])[:, None]
        offsets = np.sum(normals * corners, axis=1)
    turn = rotation_of(wall.get("rpy", (0.0, 0.0, wall.get("angle", 0.0))))
    normals = normals @ turn[: normals.shape[1], : normals.shape[1]].T
    return normals, offsets + normals @ np.array(wall["center"], np.float64)


def _carried(pose: Floats, point: Floats) -> Floats:
    """Return the world positions (n, 2 or 3) of a body's point for poses (n, 3 or 7)."""
    if pose.shape[1] == 3:
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        return pose[:, :2] + np.column_stack([c * point[0] - s * point[1], s * point[0] + c * point[1]])
    axis, w = pose[:, 3:6], pose[:, 6:]
    return np.asarray(pose[:, :3] + point + 2.0 * np.cross(axis, np.cross(axis, point) + w * point), np.float64)


def _crossed(height: Floats) -> int:
    """Return the first step whose straight path enters and leaves a convex shape; -1 if none.

    `height` (n, e) holds the heights of a point over the faces at n instants.
    """
    before, after = height[:-1], height[1:]
    outside = (before.max(axis=1) > 0.0) & (after.max(axis=1) > 0.0) & ~((before > 0.0) & (after > 0.0)).any(axis=1)
    k = np.flatnonzero(outside)  # they cross every face that they are beyond
    before, after = before[k], after[k]
    share = before / np.where(before == after, 1.0, before - after)
    enters = np.where((before > 0.0) & (after <= 0.0), share, 0.0).max(axis=1)
    leaves = np.where((before <= 0.0) & (after > 0.0), share, 1.0).min(axis=1)
    through = k[leaves - enters > ROUNDED]
    return int(through[0]) if len(through) else -1


def _squeezed(run: Run) -> str:
    """Say which body moves on by more than its size in a gap that is a tenth of its size too narrow."""
    bodies, table = run.scene_resolved.get("bodies", []), run.contacts
    if not len(table.gap) or len(bodies) != len(run.body_names):
        return ""
    for b, body in enumerate(bodies):
        size = _size(body.get("shapes", ()))
        deep = table.gap < -0.5 * NARROW * size  # if two overlap by more in sum, one of them does by half of it
        if not deep.any() or not (deep & (table.body_a == b) & (table.body_b < 0)).any():
            continue
        rows = np.flatnonzero((table.body_a == b) & (table.body_b < 0) & (table.gap < 0.0))
        step = np.searchsorted(table.offsets, rows, "right") - 1
        caught, narrow = _pressed(step, table.normal[rows], table.gap[rows], NARROW * size)
        if not len(caught):
            continue
        place = run.pose[caught, b, : 2 if run.pose.shape[-1] == 3 else 3]
        far = float(np.linalg.norm(place - place[0], axis=1).max())
        if far > size:
            wide = in_metres(narrow)
            return f"{run.body_names[b]} goes on by {in_metres(far)} in a gap that is {wide} narrower than it"
    return ""


def _pressed(step: Integers, normal: Floats, gap: Floats, least: float) -> tuple[Integers, float]:
    """Return the steps, ascending, in which two opposed contacts overlap by more than `least` in sum, and the most."""
    found, widest = [], 0.0
    for apart in range(1, int(np.bincount(step - step[0]).max())):  # the contacts of a step are consecutive
        facing = np.einsum("ij,ij->i", normal[:-apart], normal[apart:]) < -0.9
        narrow = -(gap[:-apart] + gap[apart:])
        caught = (step[:-apart] == step[apart:]) & facing & (narrow > least)
        found.append(step[:-apart][caught])
        widest = max(widest, float(narrow[caught].max(initial=0.0)))
    return np.unique(np.concatenate([np.zeros(0, np.int64), *found])), widest


def _flew(run: Run) -> str:
    """Say which position is farther than start, speed and acceleration can explain."""
    lengths = [i for i, unit in enumerate(run.coordinate_units) if unit == "m"]
    if not lengths or not run.steps:
        return ""
    moved = [max(float(run.q[:, i].max() - run.q[0, i]), float(run.q[0, i] - run.q[:, i].min())) for i in lengths]
    most, i = max(zip(moved, lengths, strict=True), key=lambda each: each[0])
    scene, time = run.scene_resolved, float(run.time[-1])
    reach = float(np.abs(run.q[0]).max() + np.abs(run.v[0]).max() * time)
    if most <= WILD * reach:
        return ""
    masses = [body["mass"] for body in scene.get("bodies", ()) if body.get("mass")]
    push = float(np.linalg.norm(run.hand_force, axis=1).max(initial=0.0)) / min(masses, default=1.0)
    acceleration = float(np.linalg.norm(scene.get("gravity") or [0.0])) + push
    reach += 0.5 * acceleration * time**2
    reach += max((_size(body.get("shapes", ()), 0.0) for body in scene.get("bodies", ())), default=0.0)
    if most <= WILD * reach:
        return ""
    return f"{run.coordinate_names[i]} moves by {in_metres(most)}, where {in_metres(reach)} can be explained"


def _overran(run: Run) -> str:
    """Say which joint goes beyond a limit by more than half of its range, or by more than a tenth at the end."""
    bodies = run.scene_resolved.get("bodies", [])
    first = np.cumsum([0, *(KINDS[body["joint"]].nq for body in bodies)])
    for i, body in zip(first, bodies, strict=False):
        if not body.get("joint_limits") or first[-1] != run.q.shape[1]:
            continue
        low, high = body["joint_limits"]
        beyond = np.maximum(low - run.q[:, i], run.q[:, i] - high) / (high - low)
        k = len(beyond) - 1 if beyond[-1] > OVERRUN else int(beyond.argmax())
        if beyond[k] > (OVERRUN if k == len(beyond) - 1 else DEEP):
            return (f"{run.coordinate_names[i]} is {run.q[k, i]:.3g} at {run.time[k]:.4g} s, beyond its limits {low:g} "
                    f"and {high:g} by {beyond[k]:.3g} times their range")
    return ""
