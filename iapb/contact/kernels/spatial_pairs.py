"""Contacts of spatial shapes: spheres and half-spaces with everything; boxes among themselves in `box_pair`.

As in the plane: the normal points from b into a, gap < 0 is overlap, the point lies midway between the surfaces,
a contact is kept when gap <= margin. Every normal is finite and of unit length, also where centres coincide.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.geometry import BOX, HALF_SPACE, SPHERE
from iapb.contact.kernels.box_pair import boxes
from iapb.contact.kernels.shape_frames import vertex_feature
from iapb.contact.kernels.spatial_frames import store_in_space, world_axis, world_center
from iapb.mechanics.kernels.vectors import add, dot, load, scale, subtract


@kernel
def spatial_pair(shapes, a, b, R, p, margin, buffer, count):
    """Contacts of two spatial shapes; a half-space is always b."""
    kind_a, kind_b = shapes.kind[a], shapes.kind[b]
    if kind_b == HALF_SPACE:
        if kind_a == SPHERE:
            return sphere_half_space(shapes, a, b, R, p, margin, buffer, count)
        return box_half_space(shapes, a, b, R, p, margin, buffer, count)
    if kind_a == BOX and kind_b == BOX:
        return boxes(shapes, a, b, R, p, margin, buffer, count)
    if kind_a == SPHERE and kind_b == SPHERE:
        return spheres(shapes, a, b, R, p, margin, buffer, count)
    if kind_a == SPHERE:
        return sphere_box(shapes, a, b, True, R, p, margin, buffer, count)
    return sphere_box(shapes, b, a, False, R, p, margin, buffer, count)


@kernel
def spheres(shapes, a, b, R, p, margin, buffer, count):
    """Two spheres: gap = distance of the centres - both radii; coincident centres get the normal ±z."""
    center_b = world_center(shapes, b, R, p)
    apart = subtract(world_center(shapes, a, R, p), center_b)
    radius_a, radius_b = shapes.radius[a], shapes.radius[b]
    distance = math.sqrt(dot(apart, apart))
    gap = distance - (radius_a + radius_b)
    if gap > margin:
        return count
    normal = (0.0, 0.0, 1.0 if a < b else -1.0)
    if distance > 0.0:
        normal = (apart[0] / distance, apart[1] / distance, apart[2] / distance)
    point = add(center_b, scale(0.5 * (distance + radius_b - radius_a), normal))
    return store_in_space(buffer, count, shapes, a, b, 0, point, normal, gap)


@kernel
def sphere_half_space(shapes, a, b, R, p, margin, buffer, count):
    """gap = (centre - point)·normal - radius."""
    normal, center = world_axis(shapes, b, 2, R), world_center(shapes, a, R, p)
    radius = shapes.radius[a]
    gap = dot(subtract(center, world_center(shapes, b, R, p)), normal) - radius
    if gap > margin:
        return count
    point = subtract(center, scale(radius + 0.5 * gap, normal))
    return store_in_space(buffer, count, shapes, a, b, 0, point, normal, gap)


@kernel
def box_half_space(shapes, a, b, R, p, margin, buffer, count):
    """One contact per corner of the box: gap = (corner - point)·normal."""
    normal, center = world_axis(shapes, b, 2, R), world_center(shapes, a, R, p)
    height = dot(subtract(center, world_center(shapes, b, R, p)), normal)
    x = scale(shapes.half_size[a, 0], world_axis(shapes, a, 0, R))
    y = scale(shapes.half_size[a, 1], world_axis(shapes, a, 1, R))
    z = scale(shapes.half_size[a, 2], world_axis(shapes, a, 2, R))
    over_x, over_y, over_z = dot(x, normal), dot(y, normal), dot(z, normal)
    for corner in range(8):
        sx, sy, sz = 1.0 - 2.0 * (corner & 1), 1.0 - (corner & 2), 1.0 - 0.5 * (corner & 4)
        gap = height + (sx * over_x + (sy * over_y + sz * over_z))
        if gap <= margin:
            arm = add(scale(sx, x), add(scale(sy, y), scale(sz, z)))
            point = subtract(add(center, arm), scale(0.5 * gap, normal))
            count = store_in_space(buffer, count, shapes, a, b, vertex_feature(0, corner, 0), point, normal, gap)
            if count < 0:
                return -1
    return count


@kernel
def sphere_box(shapes, sphere, box, sphere_is_a, R, p, margin, buffer, count):
    """A sphere and a box: one contact at the box's nearest point; a centre inside leaves by the nearest face."""
    center = world_center(shapes, sphere, R, p)
    apart = subtract(center, world_center(shapes, box, R, p))
    half, radius = load(shapes.half_size, box), shapes.radius[sphere]
    reach = half[0] + half[1] + half[2] + radius + margin
    if dot(apart, apart) > reach * reach:
        return count
    axes = (world_axis(shapes, box, 0, R), world_axis(shapes, box, 1, R), world_axis(shapes, box, 2, R))
    inside, region, outward = True, 0, (0.0, 0.0, 0.0)
    exit_distance, exit_region, exit_normal = math.inf, 0, (0.0, 0.0, 1.0)
    for k in range(3):
        x = dot(apart, axes[k])
        beyond = abs(x) - half[k]
        sign = 1.0 if x >= 0.0 else -1.0
        if beyond > 0.0:
            inside, region = False, region + (1 if x > 0.0 else 2) * 3**k
            outward = add(outward, scale(sign * beyond, axes[k]))
        if -beyond < exit_distance:
            exit_distance, exit_region = -beyond, (1 if x >= 0.0 else 2) * 3**k
            exit_normal = scale(sign, axes[k])
    distance = math.sqrt(dot(outward, outward))
    if inside or distance == 0.0:
        distance, region, normal = -exit_distance, exit_region, exit_normal
    else:
        normal = (outward[0] / distance, outward[1] / distance, outward[2] / distance)
    gap = distance - radius
    if gap > margin:
        return count
    point = subtract(center, scale(radius + 0.5 * gap, normal))
    feature = vertex_feature(1, region, 0)
    if sphere_is_a:
        return store_in_space(buffer, count, shapes, sphere, box, feature, point, normal, gap)
    return store_in_space(buffer, count, shapes, box, sphere, feature, point, scale(-1.0, normal), gap)
