"""What accuracy costs in time: impacts, steps, whole motions, effects. Every number is measured in turn."""
