"""The Coq development: `make -C verification/proofs/coq` compiles it and leaves checked.json (see
`checked`)."""
