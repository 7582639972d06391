# make demo    the table of pulled strips: simulate, tabulate, plot, into out/strip_pull
# make test    the tests of every change: physics, units, and a few of processes, browsers and pages
# make test-nightly  the others: what takes long, caches, pools, signals, campaigns, browsers, all pages; then make test-machines
#              for the physics tests
# make test-machines  the tests as on other processors: other BLAS kernels, generic machine code (four times as long as make test;
#              ONE="--one tests/physics": the physics tests, in the first setting that is not this machine's own)
# make lint    ruff, mypy, import-linter
# make validate  every check of validation/ and the gallery of them, with the pages, into out/docs/html (a quarter of an hour;
#              FULL=--full: what takes long, too)
# make coverage  lines and branches that tests reach, kernels run by Python itself, into out/coverage (about half an hour)
# make keys    the tables of keys in docs/case_file.md, from the models
# make figures the page of all kinds of figures, docs/figures.md
# make docs    the pages: guide, tutorials (executed), API, the gallery as it was last run
# make bench   run time against error of all methods, into out/benchmarks (an hour or two; QUICK=--quick: a few minutes)
#
# Needs Python 3.11 to 3.14 and make; everything else goes into .venv. Another Python: make PYTHON=python3.12 demo

PYTHON ?= python3
WORKERS ?= 2
VENV := .venv
BIN := $(VENV)/bin
# what .venv holds: the package, or the package and the tools; inside .venv, so that they go with it
RUN := $(VENV)/.fsm-run
DEV := $(VENV)/.fsm-dev
DOC := $(VENV)/.fsm-docs
COV := $(VENV)/.fsm-coverage

VERSION_CHECK := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))

.PHONY: help demo test test-nightly test-machines coverage lint check bench validate figures keys docs clean distclean
.DELETE_ON_ERROR:

help:
	@sed -n '1,/^$$/s/^# \{0,1\}//p' Makefile

demo: $(RUN)
	$(BIN)/fsm table folding_cases/strip_pull/table.csv --out out/strip_pull --figures all

# kernels are compiled before the tests, in processes of their own: a worker that compiles grows to gigabytes. The tests take
# two turns, because those that are not compiled before grow the workers too
test: $(DEV)
	$(BIN)/fsm warmup
	$(BIN)/python -m pytest -m "not nightly" -n $(WORKERS) --dist worksteal tests/physics
	$(BIN)/python -m pytest -m "not nightly" -n $(WORKERS) --dist worksteal tests/unit tests/robustness

test-nightly: $(DEV)
	$(BIN)/fsm warmup
	$(BIN)/python -m pytest -m nightly -n $(WORKERS) --dist worksteal
	$(MAKE) --no-print-directory test-machines ONE="--one tests/physics"

ONE ?=
test-machines: $(DEV)
	$(BIN)/python -m tests.machines -m "not nightly" -n $(WORKERS) --dist worksteal $(ONE)

# compiled, for all that is no kernel; then the kernels, line by line, from tests that Python gets through (tests/pure_python.py)
coverage: $(COV)
	rm -rf out/coverage
	$(BIN)/python -m coverage run -m pytest -m "not nightly" -n $(WORKERS) --dist worksteal
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m coverage run -m pytest -p tests.pure_python -m "not nightly" -n $(WORKERS) --dist worksteal
	$(BIN)/python -m coverage combine --quiet
	$(BIN)/python -m coverage html --quiet
	$(BIN)/python -m coverage json --quiet
	$(BIN)/python -m coverage report
	$(BIN)/python -m tests.covered out/coverage/figures.json

lint: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

check: lint test

QUICK ?=
bench: $(RUN)
	$(BIN)/python -m validation.benchmarks $(QUICK)

# the pages are made also when a check is red, and say so; the exit code is that of the checks
FULL ?=
validate: $(DOC)
	$(BIN)/python -u -m validation.gallery $(FULL); checked=$$?; $(MAKE) --no-print-directory docs && exit $$checked

figures: $(RUN)
	$(BIN)/python docs/figures/draw.py

keys: $(RUN)
	$(BIN)/python docs/_ext/key_tables.py

docs: $(DOC)
	$(BIN)/python -m sphinx -W --keep-going -q -E -b html docs out/docs/html
	@echo "pages: out/docs/html/index.html"

# An environment that is there already, made by hand or by another version, is kept and brought up to date.
$(BIN)/python:
	@command -v $(PYTHON) >/dev/null || { \
	  echo "fsm needs Python 3.11 to 3.14, and there is no $(PYTHON) here: try make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c '$(VERSION_CHECK)' || { \
	  echo "fsm needs Python 3.11 to 3.14, and $(PYTHON) is $$($(PYTHON) --version): try make PYTHON=python3.12" >&2; exit 1; }
	@rm -f $(RUN) $(DEV) $(DOC) $(COV)
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(RUN): pyproject.toml | $(BIN)/python
	$(call install,.)
	@touch $@

$(DEV): pyproject.toml | $(BIN)/python
	$(call install,.[test$(comma)dev])
	@touch $(RUN) $@

$(COV): pyproject.toml | $(BIN)/python
	$(call install,.[test$(comma)coverage])
	@touch $(RUN) $@

$(DOC): pyproject.toml | $(BIN)/python
	$(call install,.[docs])
	@touch $(RUN) $@

comma := ,
define install
@$(BIN)/python -c '$(VERSION_CHECK)' || { \
  echo "$(VENV) holds $$($(BIN)/python --version), fsm needs Python 3.11 to 3.14: make distclean, then again" >&2; \
  exit 1; }
@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(BIN)/python -m ensurepip
$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '$(1)'
@$(BIN)/python -m compileall -q fsm
endef

clean:
	rm -rf out docs/generated build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis *.egg-info
	find . -path ./$(VENV) -prune -o -name __pycache__ -type d -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV)
