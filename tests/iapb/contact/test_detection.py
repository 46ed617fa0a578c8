"""Contacts of shapes against support functions and coal; bits that order and place must not
change."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from iapb.contact import finding
from iapb.contact.finding import ContactFinder
from iapb.contact.kernels import broadphase
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from iapb.system import System
from reports.store.keys import content_hash
from tests.given import data_of
from tests.iapb.contact.convex import convex, directions, separations
from tests.iapb.contact.paper import scene_of
from verification.cost.steps import field_of_discs

Values = dict[str, Any]


CROWD = data_of(__file__, "crowd.yaml")
CROWDS = {
    False: System(scene_from_values(CROWD["plane"])),
    True: System(scene_from_values(CROWD["space"])),
}
SPACES = pytest.mark.parametrize("space", [False, True])


def thrown(system: System, seed: int, spread: float = 0.5) -> np.ndarray:
    """A random configuration about the origin."""
    m = system.mechanism
    size = m.nv // 6
    step = (
        [spread] * (size // 2) + [1.5] * (size - size // 2) if size == 6 else [spread, spread, 3.0]
    )
    return m.integrate(
        m.neutral(), np.random.default_rng(seed).uniform(-1.0, 1.0, m.nv) * np.tile(step, 6)
    )


def names_of(found: Any) -> list[tuple[int, int, int]]:
    return list(
        zip(found.shape_a.tolist(), found.shape_b.tolist(), found.feature.tolist(), strict=True)
    )


@SPACES
@pytest.mark.parametrize("margin", [0.0, 0.2, 3.0])
def test_contacts_of_a_crowd_are_those_of_support_functions(space: bool, margin: float) -> None:
    """The pairs, the deepest gap of each and its direction; both surfaces have the point."""
    counts = set()
    for seed in range(30):
        system = CROWDS[space]
        q = thrown(system, seed, 0.5 + 0.5 * (margin > 1.0))
        placed = system.mechanism.placements(q)
        solids = [convex(system.shapes, s, *placed) for s in range(len(system.shapes.kind))]
        found = system.contacts_at(q, margin)
        names = names_of(found)
        assert len(set(names)) == len(names)
        for a, b in system.pairs.tolist():
            mine = [i for i, name in enumerate(names) if name[:2] == (a, b)]
            counts.add(len(mine))
            one = solids[a]
            other = solids[b]
            expected = separations(one, other, directions(one, other)).max()
            # edges give way to faces, and b's face to a's, within these shares of the face's overlap
            boxes = len(one.corners) == len(other.corners) == 8
            near = 1e-9 + boxes * (0.05 / 0.95 * abs(expected) + 2e-4)
            if abs(expected - margin) > near:
                assert bool(mine) == (expected <= margin), (a, b)
            for i in mine:
                n = found.normal[i]
                x = found.point[i]
                gap = found.gap[i]
                along = separations(one, other, n[None])[0]
                assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-14)
                assert gap <= margin and along == pytest.approx(expected, abs=near)
                if not (boxes and expected > 0.0):  # else the gap is a lower bound
                    assert one.beyond(x + 0.5 * gap * n) <= 1e-9
                    assert other.beyond(x - 0.5 * gap * n) <= 1e-9
                assert gap >= along - 1e-9
                assert (found.body_a[i], found.body_b[i]) == tuple(system.shapes.body[[a, b]])
            if mine:
                least = found.gap[mine].min()
                assert least == pytest.approx(expected, abs=near) or boxes and least > expected > 0
        assert space or not (found.point[:, 2].any() or found.normal[:, 2].any())
    assert counts >= ({1, 3, 4, 8} if space and margin > 1.0 else {1, 2})


@SPACES
def test_names_last_while_bodies_move_a_little(space: bool) -> None:
    """Else every step of what slides or rolls would be a new contact. Which four of more corners
    stay may tie."""
    for seed in range(20):
        system = CROWDS[space]
        q = thrown(system, seed)
        moved = system.mechanism.integrate(
            q, np.random.default_rng(seed).normal(size=system.mechanism.nv), 1e-10
        )
        before, after = (Counter(names_of(system.contacts_at(place))) for place in (q, moved))
        many = {
            pair for pair, number in Counter(name[:2] for name in before).items() if number == 4
        }
        assert {name for name in before if name[:2] not in many} == {
            name for name in after if name[:2] not in many
        }


GIVEN = data_of(__file__, "exact_gaps.yaml")
DISC, BRICK, BALL, CUBE = (GIVEN["shapes"][name] for name in ("disc", "brick", "ball", "cube"))
EXACT = GIVEN["gaps"]


def pair_of(a: Values, b: Values, swapped: bool = False) -> System:
    """A free body with shape a, and b: a wall, or the shape of another free body, which `swapped`
    puts first."""
    space = len(b.get("normal", b.get("size", [0, 0]))) == 3 or b["kind"] == "sphere"
    free = (
        {"joint": "free_flyer", "inertia": [1, 1, 1]}
        if space
        else {"joint": "planar", "inertia": 1}
    )
    bodies = [
        {"name": f"b{k}", "mass": 1.0, "shapes": [shape]} | free for k, shape in enumerate((a, b))
    ]
    if "normal" in b:
        return System(scene_of(bodies[:1], [{"name": "wall"} | b]))
    return System(scene_of(bodies[::-1] if swapped else bodies, []))


def at_places(system: System, *places: list[float]) -> np.ndarray:
    q = system.mechanism.neutral()
    size = len(q) // len(places)
    for k, place in enumerate(places):
        q[k * size : k * size + len(place)] = place
    return q


def test_boxes_in_space_overlap_as_coal_says() -> None:
    """Depth of two boxes at random, where a face decides and where edges do."""
    coal = pytest.importorskip("coal")
    rng = np.random.default_rng(0)
    compared = 0
    for _ in range(100):
        sizes = rng.uniform(0.5, 1.5, size=(2, 3)).tolist()
        system = pair_of(*({"kind": "box", "size": size} for size in sizes))
        step = rng.normal(scale=[0.4, 0.4, 0.4, 1.5, 1.5, 1.5] * 2)
        q = system.mechanism.integrate(system.mechanism.neutral(), step)
        gap = system.contacts_at(q).gap.min(initial=0.0)
        result = coal.CollisionResult()
        poses = map(coal.Transform3s, *system.mechanism.placements(q))
        boxes = [
            coal.CollisionObject(coal.Box(*size), pose)
            for size, pose in zip(sizes, poses, strict=True)
        ]
        coal.collide(*boxes, coal.CollisionRequest(), result)
        depth = result.getContact(0).penetration_depth if result.isCollision() else 0.0
        compared += depth < 0.0
        assert gap == pytest.approx(depth, abs=1e-6 + 0.05 * abs(depth))
    assert compared > 25


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("swapped", [False, True])
def test_a_gap_of_the_margin_is_kept_and_the_next_number_is_not(name: str, swapped: bool) -> None:
    a, b, place, gap, number = (EXACT[name][key] for key in ("a", "b", "place", "gap", "number"))
    swapped = swapped and "normal" not in b
    still = [0.0] * len(place)
    system = pair_of(a, b, swapped)
    q = at_places(
        system, *((still, place) if swapped else (place,) if "normal" in b else (place, still))
    )
    found = system.contacts_at(q, gap)
    assert found.gap.tolist() == [gap] * number
    assert len(system.contacts_at(q, np.nextafter(gap, 0.0)).gap) == 0


@pytest.mark.parametrize("shape", [DISC, BRICK, BALL, CUBE])
@pytest.mark.parametrize("other", [DISC, BRICK, BALL, CUBE])
def test_shapes_on_one_centre_have_finite_unit_normals(shape: Values, other: Values) -> None:
    if (shape in (BALL, CUBE)) != (other in (BALL, CUBE)):
        return
    system = pair_of(shape, other)
    found = system.contacts_at(system.mechanism.neutral())
    assert len(found.gap) >= 1 and np.isfinite(found.point).all() and (found.gap < 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-15)


@pytest.mark.parametrize("tilt", [-1e-12, 0.0, 1e-12])
@SPACES
def test_a_flat_face_on_a_face_keeps_its_points_and_names_whichever_rounding_takes(
    space: bool, tilt: float
) -> None:
    """Two ends of the common edge; in space the four corners of the common rectangle, which also
    carry the middle."""
    small, large = ([0.2, 0.2, 0.1], [0.6, 0.4, 0.1]) if space else ([0.2, 0.1], [0.6, 0.1])
    for top, ground in ((small, large), (large, small)):
        system = pair_of({"kind": "box", "size": top}, {"kind": "box", "size": ground})
        place = [0.05, 0.03, 0.0999, tilt / 2] if space else [0.05, 0.0999, tilt]
        q = at_places(system, place, [0.0] * len(place))
        found = system.contacts_at(q)
        middle = np.array(place[:2] if top == small else [0.0, 0.0])  # of the small box
        corners = [middle + (x, y) for x in (-0.1, 0.1) for y in (-0.1, 0.1)][:: 1 if space else 2]
        axes = 2 if space else 1
        got = sorted(found.point[:, :axes].round(9).tolist())
        np.testing.assert_allclose(got, [corner[:axes] for corner in corners], atol=1e-9)
        np.testing.assert_allclose(found.gap, -1e-4, atol=1e-9)
        level = system.contacts_at(at_places(system, place[:-1] + [0.0], [0.0] * len(place)))
        assert sorted(level.feature.tolist()) == sorted(found.feature.tolist())


@pytest.mark.parametrize("swapped", [False, True])
def test_a_tilted_cube_on_a_large_one_is_as_deep_as_its_lowest_corner(swapped: bool) -> None:
    """The faces are parallel to 0.012 rad: that of the first box decides only if it is as near, to
    1e-4 of the size."""
    system = pair_of(CUBE, CUBE | {"size": [4, 4, 1]}, swapped)
    place = [0.0, 0.0, 1.0, 0.0, np.sin(0.006), 0.0, np.cos(0.006)]
    still = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    q = at_places(system, *((still, place) if swapped else (place, still)))
    found = system.contacts_at(q)
    deepest = 0.5 - 0.5 * (np.cos(0.012) + np.sin(0.012))
    assert found.gap.min() == pytest.approx(deepest, abs=1e-9)
    assert np.abs(found.normal[:, 2]) == pytest.approx(1.0, abs=1e-12)  # of the large face


@SPACES
def test_every_side_of_a_box_that_a_ball_can_touch_has_a_name_of_its_own(space: bool) -> None:
    """8 regions around a rectangle, 26 around a cuboid; inside, those of the faces."""
    n, half = (3, np.array([0.3, 0.2, 0.4])) if space else (2, np.array([0.3, 0.2]))
    system = pair_of(
        (BALL if space else DISC) | {"radius": 0.05}, {"kind": "box", "size": (2.0 * half).tolist()}
    )
    names: dict[int, tuple[int, ...]] = {}
    for number in range(3**n):
        signs = np.array([number // 3**k % 3 - 1 for k in range(n)])
        for depth in (
            (0.15, -0.02) if np.count_nonzero(signs) == 1 else (0.15,) if signs.any() else ()
        ):
            place = np.where(signs != 0, signs * (half + depth), 0.1 * half)
            found = system.contacts_at(at_places(system, place.tolist(), [0.0] * n), 1.0)
            assert names.setdefault(int(found.feature[0]), tuple(signs)) == tuple(signs)
    assert len(names) == 3**n - 1


# --- the whole of a run
# ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("forces", ["paper", "implicit"])
def test_many_shapes_are_found_without_asking_all_pairs(forces: str, monkeypatch: Any) -> None:
    """Forty discs in a grid that flies apart, the first one held, and a wall: the run has the bits of
    one that tests all pairs."""
    held = {"name": "disc_0", "joint": "fixed", "shapes": [{"kind": "circle", "radius": 0.02}]}
    contact = {"forces": forces} | ({"stiffness": 500} if forces == "paper" else {})
    values = {"duration": 0.2, "bodies.0": held, "contact": contact}
    scene = field_of_discs(40).with_values(values)
    run = simulate(scene)
    monkeypatch.setattr(broadphase, "WORTHWHILE_PAIRS", 10**9)
    alone = simulate(scene.with_values({"title": "all pairs"}))
    assert len(run.contacts.gap) > 200 and content_hash(run) == content_hash(alone)


def test_bodies_that_have_left_the_range_of_cells_are_found_too() -> None:
    """In space, a pair of touching balls far beyond what a grid numbers, among many that rest."""
    bodies = [
        {
            "name": f"b{k}",
            "joint": "free_flyer",
            "mass": 1.0,
            "inertia": [1, 1, 1],
            "shapes": [{"kind": "sphere", "radius": 0.25}],
            "position": [1.0 * k, 0, 0, 0, 0, 0, 1],
        }
        for k in range(20)
    ]
    for k, x in ((18, 8e8), (19, 8e8 + 0.25)):
        bodies[k]["position"] = [x, -8e8, 8e8, 0, 0, 0, 1]
    run = simulate(scene_of(bodies, []), steps=1)
    assert list(zip(run.contacts.body_a, run.contacts.body_b, strict=True)) == [(18, 19)]


@SPACES
def test_a_buffer_that_is_full_grows_and_nothing_is_written_beyond_it(
    space: bool, monkeypatch: Any
) -> None:
    system = CROWDS[space]
    placed = system.mechanism.placements(thrown(system, 0))
    enough = system.finder.find(*placed, 3.0)
    monkeypatch.setattr(finding, "FIRST_ROOM", 1)
    grown = ContactFinder(system.shapes, system.pairs).find(*placed, 3.0)
    assert len(grown.gap) > 30
    assert all(np.array_equal(*columns) for columns in zip(enough, grown, strict=True))
