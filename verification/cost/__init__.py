"""Computing time and accuracy of impacts, steps, whole motions and effects; timed calls run in
turns."""
