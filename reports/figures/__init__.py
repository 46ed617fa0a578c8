"""The figures of the report: one file each, and one line here."""

from __future__ import annotations

from reports.figures import (
    agreement_map,
    cost_of_contacts,
    energy_gains,
    fig01_contact_forces,
    fig02_two_link_arm,
    fig03_energy_loss,
    fig04_peg_corner,
    fig05_couplings,
    fig07_trajectories,
    fig08_forces,
    fig09_device_limits,
    fig10_limited_trajectories,
    fig11_limited_forces,
    fig12_device_trajectories,
    fig13_device_forces,
    hardness,
    hero_corner,
    performance_profile,
    rigid_convergence,
    scenes_gallery,
    stability_map,
    work_precision,
)
from reports.figures.figure import Recipe

RECIPES: tuple[Recipe, ...] = (
    hero_corner.RECIPE,
    fig04_peg_corner.RECIPE,
    fig02_two_link_arm.RECIPE,
    fig01_contact_forces.RECIPE,
    scenes_gallery.RECIPE,
    fig05_couplings.RECIPE,
    fig03_energy_loss.RECIPE,
    fig07_trajectories.RECIPE,
    fig08_forces.RECIPE,
    fig09_device_limits.RECIPE,
    fig10_limited_trajectories.RECIPE,
    fig11_limited_forces.RECIPE,
    fig12_device_trajectories.RECIPE,
    fig13_device_forces.RECIPE,
    energy_gains.RECIPE,
    work_precision.RECIPE,
    stability_map.RECIPE,
    hardness.RECIPE,
    agreement_map.RECIPE,
    cost_of_contacts.RECIPE,
    performance_profile.RECIPE,
    rigid_convergence.RECIPE,
)
