# `make book` trains, executes and builds everything; `make test` passes the tests.

PYTHON ?= python3.11
BIN := .venv/bin

export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

.PHONY: help book smoke chapter study bench test check clean

help:  ## Show this list
	@sed -n 's/^\([a-z]*\):.*## /  make \1\t/p' Makefile | expand -t 16

book: .venv/ready  ## Train what is missing, execute every chapter, build _build/html
	@$(BIN)/python book/build.py

smoke: .venv/ready  ## The same book with four episodes a run, in _build/smoke/html
	@$(BIN)/python book/build.py --smoke

chapter: .venv/ready  ## One chapter: make chapter CHAPTER=03_rdes P="-p episodes 20"
	@$(BIN)/python book/build.py --chapter "$(CHAPTER)" $(P)

study: .venv/ready  ## Train the whole study, or what is missing of it: hours, and it can be interrupted
	@$(BIN)/python -m nmpcrl study

bench: .venv/ready  ## Measure how long solves, steps and runs take, and print what is reached
	@$(BIN)/python -m nmpcrl bench

test: .venv/ready  ## All tests; those of the site need a built book and a Chromium
	@$(BIN)/python -m pytest

check: .venv/ready  ## Lint, format, types, and the structure of the notebooks
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/python -m pytest tests/book/test_notebooks.py tests/test_architecture.py

clean:  ## Remove the built book; stored runs stay
	rm -rf _build

.venv/ready: environment.txt pyproject.toml
	@$(PYTHON) -c 'import ensurepip, sys, venv; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null || \
	  { echo "Python 3.11 (with venv) is needed and $(PYTHON) is not it: install it, or say where: make PYTHON=/path/to/python3.11"; exit 1; }
	@echo "Installing the pinned packages of environment.txt into .venv: some minutes, once."
	@$(PYTHON) -m venv --clear .venv
	@$(BIN)/pip install -qq --disable-pip-version-check -r environment.txt
	@$(BIN)/pip install -qq --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@
