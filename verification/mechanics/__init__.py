"""Studies of the mechanics of linkages and free bodies; `mechanics.mechanics` returns their common
Finding."""
