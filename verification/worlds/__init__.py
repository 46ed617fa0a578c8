"""One scene in several worlds: how far apart they move, what each does with energy, and its impacts as problems."""
