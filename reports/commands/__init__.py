"""The commands of `iapb`, one file each. Slow imports are inside the functions, so that --help
answers at once."""
