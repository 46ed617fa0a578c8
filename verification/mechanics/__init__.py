"""Studies of the mechanics of linkages and free bodies; `mechanics.mechanics` is the finding of them all."""
