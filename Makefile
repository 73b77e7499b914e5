# Everything happens in this folder: the environment in .venv, Shoal's state in .shoal.
.DEFAULT_GOAL := help
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory

UV_VERSION := 0.13.8
BIN := .venv/bin
STAMP := .venv/.installed
DEVELOPED := .venv/.developed
# What commands, flows, services and `make up` need; the rest of the lock is for development.
RUN := engines mujoco xacro pipeline services deploy scale fmu notebook sample
SUITABLE := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))

# Without compiled modules every process of the tests would spend seconds on reading sources. What every command imports is
# compiled at once: containers often forbid Python to do so later.
unexport PYTHONDONTWRITEBYTECODE
OFTEN := click llvmlite numba numpy pydantic rich scipy yaml
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export DO_NOT_TRACK := true

.PHONY: help setup develop demo kernels test golden lint types imports containers bench charts docs up up-postgres secrets
.PHONY: lock clean

help:  ## this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 13

setup: $(STAMP)  ## make .venv and install the locked packages that Shoal needs to run

# `make setup PYTHON=/path/to/python` chooses another interpreter.
$(STAMP): pyproject.toml requirements.lock
	@python=""; \
	for candidate in $(or $(PYTHON),python3 python3.11 python3.12); do \
	  if "$$candidate" -c '$(SUITABLE)' 2>/dev/null; then python="$$candidate"; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
	  echo "Shoal needs Python 3.11 or 3.12 with venv and pip (on Debian: apt install python3-venv)." >&2; \
	  echo "Tried: $(or $(PYTHON),python3 python3.11 python3.12). Choose one with: make setup PYTHON=/path/to/python" >&2; \
	  exit 1; \
	fi; \
	if ! $(BIN)/python -c '$(SUITABLE)' 2>/dev/null || ! $(BIN)/uv --version 2>/dev/null | grep -qF 'uv $(UV_VERSION)'; then \
	  echo "making .venv with $$("$$python" --version)"; \
	  "$$python" -m venv --clear .venv; \
	  $(BIN)/python -m pip install --quiet 'uv==$(UV_VERSION)'; \
	fi
	@echo "installing the locked packages"
	@VIRTUAL_ENV="$(CURDIR)/.venv" $(BIN)/uv pip install --quiet --constraints requirements.lock \
	  --requirements pyproject.toml $(RUN:%=--extra %)
	@VIRTUAL_ENV="$(CURDIR)/.venv" $(BIN)/uv pip install --quiet --no-deps --build-constraints requirements.lock --editable .
	@$(BIN)/python -m compileall -q -j 0 services flows validation $(addprefix .venv/lib/python3*/site-packages/,$(OFTEN))
	@touch $@

develop: $(DEVELOPED)  ## setup, and the locked tools of development: tests, types, documents, browser

$(DEVELOPED): $(STAMP)
	@echo "installing the locked tools of development"
	@VIRTUAL_ENV="$(CURDIR)/.venv" $(BIN)/uv pip install --quiet --requirements requirements.lock
	@touch $@

demo: setup  ## identify and compare both cases of the paper; one table, one report
	@$(BIN)/shoal demo

kernels: setup
	@echo "compiling the kernels (once)"
	@$(BIN)/python -m shoal.mechanics.warm

# Of two cores three processes leave hardly any idle: some tests wait for a server, a service or another's compilation.
# A file stays in one process, which makes its fixtures once; in order, as the longest files come early.
test: kernels develop  ## the tests
	@OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 3 --dist loadfile --no-loadscope-reorder $(ARGS)

golden: kernels develop  ## the words of each command, in tests/golden/
	$(BIN)/python tests/test_golden.py

lint: develop  ## style, format and spelling
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@$(BIN)/codespell docs README.md CHANGELOG.md

types: develop  ## static types
	@$(BIN)/mypy

imports: develop  ## imports go one way
	@$(BIN)/lint-imports

containers: develop  ## the compose file against its schema, the Dockerfile against good practice
	@$(BIN)/check-jsonschema --builtin-schema vendor.compose-spec docker-compose.yml
	@$(BIN)/hadolint Dockerfile

bench: develop  ## speed and accuracy against the other engines
	@$(BIN)/python -m shoal_validation.benchmarks

charts: develop  ## every chart and table of docs/ again (hours; ARGS=--list, ARGS="--only NAME", ARGS="--since DATE")
	@$(BIN)/python -m shoal_validation.renew $(ARGS)

docs: develop  ## the documentation as pages, in site/
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "documentation: site/index.html"

up: setup  ## MLflow, Prefect with a worker and the engines' services, until Ctrl-C (ARGS=--help)
	@$(BIN)/python -m shoal_flows.deployment.up $(ARGS)

up-postgres: setup  ## the same on a PostgreSQL server of its own
	@$(BIN)/python -m shoal_flows.deployment.up --postgres $(ARGS)

secrets:  ## passwords for docker-compose.yml, where there are none
	@sh deploy/secrets.sh

# The extras that the lock holds: all but the one that is too large for what it brings.
LOCKED = $(shell $(BIN)/python -c 'import tomllib; \
  extras = tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]; \
  print(*(f"--extra {name}" for name in extras if name != "openturns"))')

lock: setup  ## resolve pyproject.toml anew into requirements.lock
	@$(BIN)/uv pip compile --quiet --upgrade --generate-hashes $(LOCKED) --no-emit-index-url --no-header --no-annotate -p 3.11 \
	  pyproject.toml -o requirements.lock

clean:  ## remove the environment, the caches and the state, but for the library
	@[ ! -d .shoal ] || find .shoal -mindepth 1 -maxdepth 1 ! -name library -exec rm -rf {} +
	@rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis dist
