# `make test` and `make reproduce` are all that a fresh machine needs (python >= 3.11 with venv, make, git).

SHELL := /bin/bash
.DEFAULT_GOAL := help

# The first python that is new enough; choose another one with `make PYTHON=python3.12 test`.
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --quiet --quiet --disable-pip-version-check --no-input
# uv installs in a third of pip's time; where it cannot, say without an index that it knows, pip does.
UV := UV_HTTP_TIMEOUT=30 UV_DEFAULT_INDEX="$${PIP_INDEX_URL:-$$($(BIN)/python -m pip config get global.index-url 2>/dev/null)}" \
	$(BIN)/uv pip install --python $(BIN)/python
# The stamps carry what they were made from, so that another lock makes another environment.
LOCK_STAMP := $(VENV)/.lock-$(shell cksum < requirements.lock | cut -d ' ' -f 1)
PROJECT_STAMP := $(VENV)/.project-$(shell cksum < pyproject.toml | cut -d ' ' -f 1)
PYTEST_WORKERS ?= 2

.PHONY: help
help: ## show this list
	@echo "iapb: the commands of this project"
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /\1|/' | \
		while IFS='|' read -r name text; do printf '  make %-11s %s\n' "$$name" "$$text"; done

.PHONY: setup
setup: $(PROJECT_STAMP) ## make .venv from the hashed lock, if it is missing or stale

$(LOCK_STAMP):
	@test -n "$(PYTHON)" || { echo "make: no python >= 3.11 with venv was found; set PYTHON=..." >&2; exit 1; }
	@echo "Making $(VENV) from requirements.lock with $$($(PYTHON) --version); this takes a minute or two ..."
	@$(PYTHON) -m venv --clear $(VENV)
	@{ $(PIP) install --no-deps --require-hashes -r <(sed -n '/^uv==/,/^ *#/p' requirements.lock) && \
		$(UV) --quiet --no-deps --require-hashes -r requirements.lock 2>/dev/null || \
		$(PIP) install --no-deps --require-hashes -r requirements.lock; } && echo "Installing took $$SECONDS s."
	@touch $@

$(PROJECT_STAMP): $(LOCK_STAMP)
	@echo "Compiling the engine, about a minute ..."
	@$(PIP) install --no-deps --no-build-isolation --editable . && echo "Done after $$SECONDS s."
	@rm -f $(VENV)/.project-*
	@touch $@

.PHONY: test
test: setup ## ruff, mypy, import contracts, the size and the quick tests, beside each other
	@$(MAKE) --no-print-directory --jobs 4 lint types imports nodes pytest

.PHONY: reproduce
reproduce: setup ## regenerate every figure, table and claim into out/report.html; FULL=1 for the deep version
	@$(BIN)/iapb reproduce $(if $(FULL),--full)

.PHONY: verify
verify: setup ## the laws at 100,000 impacts and 7,000 trajectories; half an hour of a core; Ctrl-C prints what was found
	@$(BIN)/iapb verify-many --workers $(PYTEST_WORKERS)

.PHONY: portable
portable: setup ## tests, runs and report under other BLAS kernels, numpy, libm and threads; SETTINGS="Haswell Zen" selects
	@$(BIN)/python -m tools.portable $(PORTABLE_ARGS) --workers $(PYTEST_WORKERS) $(if $(SETTINGS),--settings $(SETTINGS))

.PHONY: fuzz
fuzz: setup ## faults done to the store, and 100,000 wrong inputs: each is read or refused by name; TIMES=80 of what tests try
	@IAPB_FUZZ=$(or $(TIMES),80) $(BIN)/python -m pytest -q -m '' tests/robustness/test_faults.py tests/robustness/test_fuzz.py

.PHONY: docs
docs: setup ## the pages of docs/ with the reference of the code, as HTML in out/docs; a warning is an error
	@$(BIN)/python -m sphinx -q -W --keep-going -b html docs out/docs

.PHONY: lint
lint: setup ## ruff: the layout of every line, and likely mistakes
	@$(BIN)/ruff format --check --quiet . || { echo "make format lays these files"; $(BIN)/ruff format --check .; exit 1; }
	@$(BIN)/ruff check .

.PHONY: types
types: setup ## mypy
	@$(BIN)/mypy

.PHONY: imports
imports: setup ## import-linter: the packages import one way
	@$(BIN)/lint-imports --no-logo

.PHONY: nodes
nodes: setup ## the size of each package, in nodes of the syntax tree, against its budget in pyproject.toml
	@$(BIN)/python -m tools.nodes

.PHONY: pytest
pytest: setup ## the test suite alone; PYTEST_ARGS="-k impact" selects
	@$(BIN)/python -m pytest -n $(PYTEST_WORKERS) --dist loadfile -q $(PYTEST_ARGS)

.PHONY: thorough
thorough: setup ## the slow tests: attacks and kills, out/report.html in a browser, docs/, Coq; CI runs them, too
	@$(BIN)/python -m pytest -n $(PYTEST_WORKERS) --dist loadfile -q -m thorough $(PYTEST_ARGS)

.PHONY: deep
deep: setup ## the test suite with long property searches, and the kit on sound resolvers at 100 seeds (hours)
	@IAPB_HYPOTHESIS_PROFILE=deep $(BIN)/python -m pytest -n $(PYTEST_WORKERS) --dist load -q -m '' $(PYTEST_ARGS)

.PHONY: format
format: setup ## let ruff lay every line, and repair what it can
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

.PHONY: packages
packages: ## build wheel and sdist, use them in empty environments of Python 3.11 to 3.13; EXTRA=all with that extra
	@$(PYTHON) -m tools.packages $(if $(EXTRA),--extra $(EXTRA))

.PHONY: lock
lock: ## resolve requirements.lock again from pyproject.toml (needs uv)
	@uv pip compile --quiet --universal --generate-hashes --no-emit-index-url --no-emit-find-links \
		--python-version 3.11 --custom-compile-command "make lock" --extra all --group dev pyproject.toml -o requirements.lock

.PHONY: clean
clean: ## remove what runs, tests and builds left (keeps .venv)
	@rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis *.egg-info verification/proofs/coq/{build,checked.json}
	@find iapb reference verification reports tests -name __pycache__ -prune -exec rm -rf {} +

.PHONY: distclean
distclean: clean ## as clean, and .venv too
	@rm -rf $(VENV)
