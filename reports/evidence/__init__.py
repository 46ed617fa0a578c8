"""What the report is made of, topic by topic: computed once, kept in HDF5, read back the next time."""
