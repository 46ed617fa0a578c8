"""The figures of the report in page order: each is a recipe in the module of its topic, and one line here."""

from __future__ import annotations

from reports.figures import (
    complementarity,
    corner,
    cost,
    energy_gains,
    engine_errors,
    fig05_couplings,
    film,
    linked_impacts,
    mechanics,
    scenes_ledger,
    scenes_plane,
    scenes_space,
    stability,
    two_link_arm,
)
from reports.figures.figure import Recipe

RECIPES: tuple[Recipe, ...] = (
    corner.hero,
    *film.RECIPES[:1],  # the corner: on the first page, beside the hero
    complementarity.where_to_stop,
    scenes_plane.peg_corner,
    two_link_arm.arm,
    scenes_plane.contact_forces,
    scenes_plane.gallery,
    scenes_ledger.scenes_ledger,
    scenes_space.scenes_space,
    fig05_couplings.couplings,
    two_link_arm.energy_loss,
    *film.RECIPES[1:],
    *corner.RECIPES,
    energy_gains.energy_gains,
    cost.which_method,
    cost.where_iapb_loses,
    cost.impact_accuracy,
    cost.budget_share,
    cost.trajectory_precision,
    cost.integrator_precision,
    cost.anytime,
    linked_impacts.linked_impacts,
    mechanics.coordinate_invariance,
    mechanics.tumbling_drift,
    mechanics.socket_collisions,
    stability.stability_map,
    stability.hardness,
    complementarity.agreement_map,
    complementarity.cost_of_contacts,
    complementarity.performance_profile,
    complementarity.rigid_convergence,
    engine_errors.engine_errors,
    cost.impact_scaling,
    cost.effect_steps,
    cost.effect_costs,
)
