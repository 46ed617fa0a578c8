"""Evidence: proofs, properties, hard cases, accuracy against time, claims. Returns plain records, writes no files."""
