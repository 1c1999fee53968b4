# The report from its configs, the tests, and the environment they need. `make help` lists it all.

PYTHON ?= python3
# Two runs at a time: a run's files are written one after the other.
MAKEFLAGS += --jobs=2
BIN := .venv/bin
READY := .venv/.ready

RUNS := decay temperature area number radius dilute speeds restitution elastic-wall sliding audit
DONE := $(RUNS:%=runs/%/.done)
WRITING := $(wildcard snooker_cli/*.py snooker_cli/*/*.py snooker_cli/report/templates/* snooker_cli/report/*.yaml snooker_cli/report/measured/* snooker_cli/animation/player/*)

.DELETE_ON_ERROR:
.PHONY: help setup report test lint check bench measured clean

help:  ## List the targets.
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(READY)  ## Make .venv with everything in it.

report: runs/report/report.pdf  ## Simulate what has changed in configs/ and write runs/report/.

test: $(READY)  ## Run the tests but the long ones.
	$(BIN)/pytest -n 2 -m "not long"

lint: $(READY)  ## Lint and check types.
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

check: lint  ## Lint, types and all tests.
	$(BIN)/pytest -n 2

bench: $(READY)  ## Measure the engine's speed; nothing else should be running.
	$(BIN)/snooker bench speed --out runs/bench

# The report takes errors, hard cases and physics from measurements kept with it, for they hold times.
measured: $(READY)  ## Measure anew what the report and README say of errors; nothing else should be running.
	for each in error hard physics; do \
		$(BIN)/snooker bench $$each --out runs/measured && \
		cp runs/measured/$$each.json snooker_cli/report/measured/ || exit 1; \
	done
	cp runs/measured/error-against-cost-report.png docs/error-against-cost.png

clean:  ## Remove all runs.
	find runs -mindepth 1 ! -name .gitkeep -delete

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("snooker needs Python 3.11 or newer: make PYTHON=python3.12" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

# A changed config makes its run anew and no other; an engine that gives other bits, or files of
# another schema, make all.
runs/%/.done: configs/%.yaml snooker_cli/engine/__init__.py snooker_cli/store/file_format.py | $(READY)
	$(BIN)/snooker run $< --out $(@D) --fresh
	@touch $@

runs/report/report.pdf: $(DONE) $(WRITING) | $(READY)
	$(BIN)/snooker report --runs runs --out runs/report
