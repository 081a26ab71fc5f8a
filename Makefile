# `make book` trains, executes and builds everything; `make test` passes those tests that take little.

PYTHONS := 3.11 3.12 3.13 3.14
PYTHON ?= $(PYTHONS:%=python%) python3
FITS := import ensurepip, sys, venv; sys.exit("%d.%d" % sys.version_info[:2] not in "$(PYTHONS)".split())
FOUND = $(shell for each in $(PYTHON); do $$each -c '$(FITS)' 2>/dev/null && command -v $$each && break; done)
BIN := .venv/bin

export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

.PHONY: help book pdf course smoke chapter lab study bench test test-site test-tenth test-lab test-all check clean

help:  ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 18

book: .venv/ready  ## Train what is missing, execute every chapter, build _build/html
	@$(BIN)/python book/build.py

pdf: .venv/ready  ## The built book as one PDF, _build/html/nmpcrl.pdf; needs a Chromium
	@$(BIN)/python book/pdf.py

course: .venv/ready  ## Notebooks for students and teachers, and slides of the built book, in _build/course
	@$(BIN)/python book/course.py

# One rule a chapter, by which book/build.py has them executed, on all cores: what is done stays done.
PLACE ?= _build
LIBRARY := $(shell find nmpcrl/ book/published/ -name "[a-z]*.*" -not -name "*.pyc" 2>/dev/null)
$(PLACE)/executed/%.ipynb: book/%.ipynb $(PLACE)/given/%.json $(LIBRARY)
	@$(BIN)/python book/run.py $< $@ $(word 2,$^)

smoke: .venv/ready  ## The same book with four episodes a run, in _build/smoke/html
	@$(BIN)/python book/build.py --smoke

chapter: .venv/ready  ## One chapter: make chapter CHAPTER=03_rdes P="-p episodes 20"
	@$(BIN)/python book/build.py --chapter "$(CHAPTER)" $(P)

lab: .venv-lab/ready  ## Open the chapters in JupyterLab, which has an environment of its own
	@NMPCRL_RUNS="$(or $(NMPCRL_RUNS),$(CURDIR)/runs)" .venv-lab/bin/jupyter lab --preferred-dir=book

study: .venv/ready  ## Train the whole study, or what is missing of it: hours, and it can be interrupted
	@$(BIN)/python -m nmpcrl investigate main_study

bench: .venv/ready  ## Measure how long learning steps and solves take
	@$(BIN)/python -m nmpcrl bench

# On all cores, up to four. `ONLY=04_ges` runs the tests with this in their name.
PYTEST = $(BIN)/python -m pytest -n logical --maxprocesses 4 --dist worksteal $(if $(ONLY),-k "$(ONLY)")
FAST := not (slow or weekly or browser or network or built or lab)
TENTH ?= today

test: .venv/ready  ## Fast tests of the library, its commands and the book's sources
	@$(PYTEST) -m "$(FAST)"

test-site: .venv/ready  ## The built book in a browser; needs a built book and a Chromium
	@$(PYTEST) -m "built and not (weekly or lab)" tests/book

test-tenth: .venv/ready  ## A tenth of the slow tests, another each day, or the one that TENTH=3 names
	@$(PYTEST) -m "not (built or lab) and not ($(FAST))" --tenth $(TENTH)

test-lab: .venv-lab/ready  ## Open every chapter, executed too, in JupyterLab; needs a built book and a Chromium
	@$(BIN)/python -m pytest -m lab $(if $(ONLY),-k "$(ONLY)") tests/book/test_lab.py

test-all: .venv/ready test-lab  ## All tests: an hour or two; needs a built book, a Chromium and a Firefox
	@$(PYTEST) -m "not lab"

check: .venv/ready  ## Lint, format, types, and the structure of the notebooks without executing any
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/python -m pytest -m "not slow" tests/book/test_notebooks.py tests/test_architecture.py

clean:  ## Remove the built book; stored runs stay
	rm -rf _build

# pip makes byte code on one core, and this on all; what is not for this Python is passed over.
QUICKLY := -qq --disable-pip-version-check --no-compile
byte_code = $(1)/bin/python -m compileall -qq -j 0 $(1)/lib >/dev/null 2>&1 || true

.venv/ready: environment.txt pyproject.toml
	@test -n "$(FOUND)" || { \
	  echo "Python $(firstword $(PYTHONS)) to $(lastword $(PYTHONS)), with venv and ensurepip, is needed, and not found" \
	    "among $(PYTHON): install it, or say where: make PYTHON=/path/to/python3"; exit 1; }
	@echo "Taking $$($(FOUND) --version), $(FOUND), and installing the pinned packages of" \
	  "environment.txt into .venv: some minutes, once."
	@$(FOUND) -m venv --clear .venv
	@$(BIN)/pip install $(QUICKLY) -r environment.txt
	@$(call byte_code,.venv)
	@$(BIN)/pip install -qq --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# The kernel of JupyterLab is the Python of .venv.
.venv-lab/ready: .venv/ready
	@echo "Installing JupyterLab into .venv-lab: a minute, once."
	@$(BIN)/python -m venv --clear .venv-lab
	@.venv-lab/bin/pip install $(QUICKLY) --constraint environment.txt jupyterlab==4.6.6
	@$(call byte_code,.venv-lab)
	@$(BIN)/python -m ipykernel install --prefix .venv-lab --name python3 >/dev/null 2>&1
	@touch $@
