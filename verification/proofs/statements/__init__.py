"""The statements, one file per topic; `verification.proofs` lists them in reading order."""
