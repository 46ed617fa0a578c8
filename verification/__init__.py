"""Evidence: proofs, properties, hard cases, accuracy against time, claims. Returns records, writes no files."""
