"""Independent answers: nothing here shares an algorithm with the engine."""
