# Makes the report, runs the tests, and creates the environment for both. `make help` lists the targets.

PYTHON ?= python3
# Two runs at a time, because a single run writes its files one after the other.
MAKEFLAGS += --jobs=2
BIN := .venv/bin
READY := .venv/.ready
TESTS_READY := .venv/.ready-for-tests
DOCS_READY := .venv/.ready-for-docs

# `$(call install,WHAT)` uses uv: one on the PATH, else one from the package index, else pip.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
install = PATH="$$PATH:$(BIN)"; \
	{ command -v uv >/dev/null || $(PIP) uv; } && \
	uv pip install --quiet --python $(BIN)/python --editable '$(1)' || \
	{ echo "uv is missing or has failed, so pip installs; this takes longer"; \
	$(PIP) --editable '$(1)'; }

RUNS := decay temperature area number radius dilute speeds restitution elastic-wall mixed sliding steady profiles audit
DONE := $(RUNS:%=runs/%/.done)
REPORT_SOURCES := $(wildcard snooker_cli/*.py snooker_cli/*/*.* snooker_cli/*/templates/* snooker_cli/reproduction/measured/*)

.DELETE_ON_ERROR:
.PHONY: help setup report test lint check docs bench measured clean

help:  ## List the targets.
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(TESTS_READY)  ## Create .venv with everything, also for tests.

report: runs/report/report.pdf  ## Simulate what has changed in configs/ and write runs/report/.

test: $(TESTS_READY)  ## Run the tests, except the long ones.
	$(BIN)/pytest -n 2 --dist worksteal -m "not long"

lint: $(TESTS_READY)  ## Check style and types.
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

check: lint  ## Check style and types, run all tests.
	$(BIN)/pytest -n 2 --dist worksteal

docs: $(DOCS_READY)  ## Build the documentation site in build/site/.
	$(BIN)/python docs/site/gallery.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

bench: $(READY)  ## Measure the engine's speed on an idle machine.
	$(BIN)/snooker bench speed --out runs/bench

# The report uses saved measurements of errors, hard cases and physics, because they depend on the machine.
measured: $(TESTS_READY)  ## Measure errors, hard cases and physics again on an idle machine.
	for each in error hard physics; do \
		$(BIN)/snooker bench $$each --out runs/measured && \
		cp runs/measured/$$each.json snooker_cli/reproduction/measured/ || exit 1; \
	done
	cp runs/measured/error-against-cost-report.png docs/error-against-cost.png
	$(BIN)/python tests/make_certain.py

clean:  ## Remove all runs.
	find runs -mindepth 1 ! -name .gitkeep -delete

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("snooker needs Python 3.11 or newer: make PYTHON=python3.12" if sys.version_info < (3, 11) else 0)'
	@echo "Creating .venv with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv .venv
	@echo "Installing snooker and what the report needs"
	@$(call install,.[report])
	@touch $@

$(TESTS_READY): $(READY)
	@echo "Installing what the tests need"
	@$(call install,.[dev])
	@touch $@

$(DOCS_READY): $(READY)
	@echo "Installing what the documentation site needs"
	@$(call install,.[docs])
	@touch $@

# A changed config repeats its run and no other. Another engine version or file schema repeats all.
runs/%/.done: configs/%.yaml snooker_cli/engine/__init__.py snooker_cli/store/file_format.py | $(READY)
	$(BIN)/snooker run $< --out $(@D) --fresh
	@touch $@

runs/report/report.pdf: $(DONE) $(REPORT_SOURCES) | $(READY)
	$(BIN)/snooker reproduce --runs runs --out runs/report
