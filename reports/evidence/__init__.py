"""The evidence of the report, topic by topic: computed once, stored in HDF5, and read back
later."""
