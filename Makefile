# Targets are described by `make help`. Only POSIX sh and GNU make are assumed.

VENV ?= .venv
PYTHON ?= python3
PYTEST_ARGS ?=

# Twice quiet: errors only.
PIP := $(VENV)/bin/python -m pip -qq --no-input --disable-pip-version-check
LOCK := requirements/constraints.txt
# A file's tests share what they set up, so a file goes to one process, in the order of
# tests/conftest.py.
PARALLEL := --numprocesses auto --dist loadfile --no-loadscope-reorder
NEEDS_MORE := slow or kicad or browser or wheel or docs

.PHONY: help env ngspice demo test check-all lint format bench mutate coverage reports picture site dist lock clean
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

env: $(VENV)/.installed ## create $(VENV) with the locked requirements and this project

# Two stamps, so that an edit of pyproject.toml does not download everything anew. Python compiles
# a module when it is first imported; pip would compile all of them, which takes a minute.
$(VENV)/.locked: $(LOCK)
	@echo "Creating $(VENV) from $(LOCK) (1.4 GB; up to four minutes)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "designer needs Python 3.11 or newer: make PYTHON=python3.11 ...")'
	@$(PYTHON) -m venv --clear $(VENV)
	@$(PIP) install --no-compile --require-hashes --requirement $(LOCK)
	@touch $@

$(VENV)/.installed: $(VENV)/.locked pyproject.toml designer/__init__.py
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

ngspice: ## check for ngspice, install it where that is possible
	@scripts/ensure-ngspice

# The directory belongs to this target: results of an older version or of other inputs may go.
demo: env ngspice ## run the paper's example with 50 samples into out/paper
	@$(VENV)/bin/designer run examples/paper.toml --samples 50 --out out/paper --overwrite
	@echo "Files in out/paper:"
	@find out/paper -type f | LC_ALL=C sort | sed 's/^/  /'

test: env ngspice ## run the quick tests; a skipped test counts as failed
	@$(VENV)/bin/python -m pytest $(PARALLEL) --no-skips -m "not ($(NEEDS_MORE))" $(PYTEST_ARGS)

# The tests come last, so that the output ends with pytest's summary line.
check-all: lint ngspice ## lint and run all the tests; a skipped test counts as failed
	@$(VENV)/bin/python -m pytest $(PARALLEL) --no-skips $(PYTEST_ARGS)

lint: env ## ruff check, ruff format --check, mypy --strict
	@$(VENV)/bin/ruff check .
	@$(VENV)/bin/ruff format --check .
	@$(VENV)/bin/mypy

format: env ## let ruff sort imports and format the code
	@$(VENV)/bin/ruff check --fix-only --quiet .
	@$(VENV)/bin/ruff format .

# The competitor that the engine is measured against: needed for nothing else.
$(VENV)/.bench: $(VENV)/.installed requirements/bench.txt
	@$(PIP) install --require-hashes --requirement requirements/bench.txt
	@touch $@

bench: $(VENV)/.bench ngspice ## run the benchmarks; which ratios have fallen?
	@$(VENV)/bin/python -m benchmarks

mutate: env ## change the program in one place, again and again: do the tests notice?
	@$(VENV)/bin/python -m benchmarks.mutation

coverage: env ngspice ## how much of the core the quick tests run, with branches
	@$(VENV)/bin/python -m benchmarks.branch_coverage $(PARALLEL) $(PYTEST_ARGS)

reports: env ngspice ## make the reports that this commit lacks
	@DESIGNER=$(VENV)/bin/designer scripts/make-reports

picture: env ngspice ## draw the README's pictures
	@$(VENV)/bin/python scripts/make-model-picture
	@$(VENV)/bin/python scripts/make-bifurcation-pictures
	@$(VENV)/bin/python scripts/make-picture
	@$(VENV)/bin/python scripts/make-board-picture
	@$(VENV)/bin/python scripts/make-explore-picture

site: env ## build the documentation into out/site
	@$(VENV)/bin/python -m sphinx -q -W --keep-going -d out/site/.doctrees docs out/site

dist: env ## build wheel and sdist into dist/, and try both in clean environments
	@scripts/make-dist $(VENV)/bin/python

lock: ## resolve pyproject.toml anew into requirements/constraints.txt
	@PYTHON=$(PYTHON) scripts/lock

clean: ## remove the environment, caches and out/
	@rm -rf $(VENV) out build dist .hypothesis .mypy_cache .pytest_cache .ruff_cache
	@find designer tests benchmarks reports -name __pycache__ -type d -prune -exec rm -rf {} +
