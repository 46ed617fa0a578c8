"""Scenes: the energy balance of the runs of the project's scenes, with losses and residuals."""
