# `make demo` walks the simulated orchard, `make test` checks everything.
# Both set up .venv on their own; nothing else has to be installed first.

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do \
	$$p -c '$(SUPPORTED)' >/dev/null 2>&1 && { echo $$p; break; }; done)
INSTALL := $(PIP) install --quiet --constraint constraints.txt --editable
DEMO_ARGS ?=
PYTEST_ARGS ?=
TORTURE_ARGS ?=
MEASURE_ARGS ?=
STUDY_ARGS ?=
COVERAGE_ARGS ?=

.PHONY: demo test lint test-export test-browser test-runtime bench evaluate fuzz torture soak measure sweep-calibrations coverage study reference clean

demo: $(VENV)/.demo-ready
	$(BIN)/fieldcam demo $(DEMO_ARGS)

test: lint
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal $(PYTEST_ARGS)

lint: $(VENV)/.test-ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test-export: $(VENV)/.export-ready
	$(BIN)/mypy export $(wildcard tests/export/*.py)
	$(BIN)/python -m pytest -m export $(PYTEST_ARGS)

test-browser: $(VENV)/.test-ready
	$(BIN)/python -m pytest -m browser $(PYTEST_ARGS)

reference: $(VENV)/.demo-ready
	$(BIN)/python -P -m fieldcam.cli.reference > docs/commands.md

test-runtime: $(VENV)/.test-ready
	$(BIN)/python -m pytest -m runtime $(PYTEST_ARGS)

bench: $(VENV)/.export-ready
	$(BIN)/python -m export.bench

evaluate: $(VENV)/.demo-ready
	$(BIN)/python -m export.evaluate

fuzz: $(VENV)/.test-ready
	HYPOTHESIS_PROFILE=fuzz $(BIN)/python -m pytest -m 'slow or not slow' -k fuzz --ignore tests/export $(PYTEST_ARGS)

torture: $(VENV)/.test-ready
	PYTHONPATH=tests $(BIN)/python -m torture $(TORTURE_ARGS)

soak: $(VENV)/.test-ready
	$(BIN)/python -m pytest -m slow tests/camera/test_head_soak.py $(PYTEST_ARGS)

measure: $(VENV)/.test-ready
	PYTHONPATH=tests $(BIN)/python -m measuring $(MEASURE_ARGS)

sweep-calibrations: $(VENV)/.test-ready
	PYTHONPATH=tests $(BIN)/python -m sweep_calibrations

study: $(VENV)/.test-ready
	$(BIN)/python -m export.study_captures $(STUDY_ARGS)
	$(BIN)/python -m export.study $(STUDY_ARGS)

coverage: $(VENV)/.test-ready
	PYTHONPATH=tests $(BIN)/python -m growth_coverage $(COVERAGE_ARGS)

clean:
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis

# An environment that was cut short has no marker file and is made again.
$(VENV)/.created:
	@test -n "$(PYTHON)" || { echo "fieldcam needs Python 3.11, 3.12 or 3.13, and none of them is on the PATH (set PYTHON=/path/to/python3)." >&2; exit 2; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) cannot make a virtual environment: install the package python3-venv (on Debian and Ubuntu: sudo apt install python3-venv)." >&2; exit 2; }
	@echo "Setting up $(VENV) with $$($(PYTHON) --version); this takes a minute or two the first time." >&2
	$(PYTHON) -m venv --clear $(VENV)
	touch $@

$(VENV)/.demo-ready: pyproject.toml constraints.txt | $(VENV)/.created
	$(INSTALL) '.[simulator,report]'
	touch $@

$(VENV)/.test-ready: pyproject.toml constraints.txt | $(VENV)/.created
	$(INSTALL) '.[simulator,serve,report,test]'
	touch $@ $(VENV)/.demo-ready

$(VENV)/.export-ready: pyproject.toml constraints.txt | $(VENV)/.created
	@echo "The export extra brings PyTorch: about 5 GB." >&2
	$(INSTALL) '.[simulator,serve,report,test,export]'
	touch $@ $(VENV)/.test-ready $(VENV)/.demo-ready
