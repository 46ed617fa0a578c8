"""Scenes: what the runs of the scenes that come with the project hold, lose and leave open."""
