"""The statements, one file each; `verification.proofs` lists them in reading order."""
