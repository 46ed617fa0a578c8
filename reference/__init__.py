"""Independent reference solutions: nothing here shares an algorithm with the engine."""
