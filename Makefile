# The newcomer's commands: `make demo`, `make test`; `make help` lists the others.
#
# Each environment is created from the pins in requirements/ and recreated when they change:
# .venv for ROS 2 Jazzy (the default), .venv-kilted for `DISTRO=kilted`.

SHELL := /bin/sh
DISTRO ?= jazzy
PYTHON ?= python3
PYTEST_ARGS ?=
DEMO_ARGS ?=
BLIND_ARGS ?=
STUDY_ARGS ?=
UV_VERSION := 0.13.8

ifeq ($(filter $(DISTRO),jazzy kilted),)
$(error DISTRO=$(DISTRO) is not supported: use DISTRO=jazzy or DISTRO=kilted)
endif

VENV := $(if $(filter jazzy,$(DISTRO)),.venv,.venv-$(DISTRO))
BIN := $(CURDIR)/$(VENV)/bin
LOWER := .venv-lower-bounds

# What a sourced ROS, another environment or a user's shell may have set, and would leak into ours.
ifdef AMENT_PREFIX_PATH
unexport LD_LIBRARY_PATH
endif
unexport PYTHONPATH PYTHONHOME PYTHONSTARTUP PYTHONOPTIMIZE PYTHONDONTWRITEBYTECODE
unexport VIRTUAL_ENV CONDA_PREFIX
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH
unexport COLCON_HOME COLCON_DEFAULTS_FILE COLCON_EXTENSION_BLOCKLIST PYTEST_ADDOPTS
unexport ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION ROS_DOMAIN_ID ROS_LOCALHOST_ONLY
unexport ROS_STATIC_PEERS ROS_DISCOVERY_SERVER ROS_NAMESPACE RMW_IMPLEMENTATION
unexport FASTRTPS_DEFAULT_PROFILES_FILE FASTDDS_DEFAULT_PROFILES_FILE CYCLONEDDS_URI
unexport PIP_USER PIP_TARGET PIP_PREFIX PIP_REQUIREMENT PIP_CONSTRAINT PIP_NO_BINARY
# the model is compiled in every environment
unexport NUMBA_DISABLE_JIT

# ROS talks on this machine only, on a domain from the process number, with logs thrown away.
ISOLATED = logs=$$(mktemp -d) && trap 'rm -rf "$$logs"' EXIT && export ROS_LOG_DIR=$$logs \
	ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ROS_DOMAIN_ID=$$(( $$$$ % 101 + 1 )) &&

.PHONY: help demo test lint format bench paper blind blind-tuning steps starts coverage ragged
.PHONY: lower-bounds colcon lock clean check-python
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

help:  ## list these commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)
	@echo '  DISTRO=jazzy|kilted selects the ROS 2 wheels, PYTHON=python3.12 the Python (3.10 to 3.13).'

demo: $(VENV)/.ready  ## plant -> DDS -> bag -> identify -> picture, in about a minute
	@$(ISOLATED) $(BIN)/python -m valve_sim_ros.demo $(DEMO_ARGS)

test: $(VENV)/.ready  ## all tests; DISTRO=kilted for the other distribution
	@$(BIN)/python -m pytest $(PYTEST_ARGS)

lint: $(VENV)/.ready  ## rules, format, types, import directions
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

format: $(VENV)/.ready  ## let ruff format and sort
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.ready  ## speed of the model and of the identification
	@set -e; for script in benchmarks/[a-z]*.py; do \
	  test -e "$$script" || { echo 'make bench: no benchmarks/*.py yet' >&2; exit 1; }; \
	  echo "$$script"; $(ISOLATED) $(BIN)/python "$$script"; done

paper: $(VENV)/.ready  ## the paper's experiments and comparison again; page in out/paper, table in doc/paper.md
	@$(BIN)/python studies/paper.py --doc doc/paper.md

blind: $(VENV)/.ready  ## diagnose hidden effects on blind records (hours, but for what is kept)
	@$(BIN)/python -m blind study --split test --seed 433 --keep doc/blind.jsonl --doc doc/blind.md \
	  $(BLIND_ARGS)

blind-tuning: $(VENV)/.ready  ## the same on the half that thresholds may be set on, no table
	@$(BIN)/python -m blind study --split tuning $(BLIND_ARGS)

steps: $(VENV)/.ready  ## is a sample with an effect as good as many short ones?
	@$(BIN)/python studies/short_steps.py

starts: $(VENV)/.ready  ## does the search find the optimum of 100 random valves?
	@$(BIN)/python studies/random_valves.py

coverage: $(VENV)/.ready  ## do 95 % intervals hold the truth 95 times in 100? (200 runs)
	@$(BIN)/python studies/interval_coverage.py

ragged: $(VENV)/.ready  ## do they hold it too with 5 % of the samples lost and 10 % jitter?
	@$(BIN)/python studies/ragged_recordings.py $(STUDY_ARGS)

lower-bounds: $(LOWER)/.ready  ## the fast tests on the oldest supported libraries
	@$(CURDIR)/$(LOWER)/bin/python -m pytest -m 'not slow' --ignore=test/test_packaging.py $(PYTEST_ARGS)

colcon: $(VENV)/.ready  ## build, test and start the package in a colcon workspace
	@$(ISOLATED) sh .ci/colcon "$(CURDIR)/$(VENV)" $(PYTEST_ARGS)

check-python:
	@command -v '$(PYTHON)' >/dev/null || { \
	  echo 'make: there is no $(PYTHON): install Python 3.10 to 3.13 (apt install python3 python3-venv)' >&2; \
	  exit 1; }
	@'$(PYTHON)' -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' || { \
	  echo "make: $(PYTHON) is $$('$(PYTHON)' --version 2>&1), but the ROS 2 wheels need Python 3.10 to" \
	  '3.13: name another one, for example: make $(MAKECMDGOALS) PYTHON=python3.12' >&2; exit 1; }
	@'$(PYTHON)' -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo 'make: $(PYTHON) cannot create virtual environments: apt install python3-venv' >&2; exit 1; }

# --no-compile: Python compiles what is imported; compiling everything takes longer than the rest
PIP_INSTALL = '$(@D)/bin/python' -m pip install --quiet --disable-pip-version-check --no-deps \
	--no-compile
READY := $(foreach environment,.venv .venv-kilted $(LOWER),$(environment)/.ready)

# The pins are complete, so pip resolves nothing.
$(READY:.ready=.pins): | check-python
	@echo 'Installing into $(@D) from $< (once; a minute or two) ...'
	@rm -rf '$(@D)'
	@'$(PYTHON)' -m venv '$(@D)'
	@$(PIP_INSTALL) --requirement '$<'
	@touch '$@'

.venv/.pins: requirements/jazzy.txt
.venv-kilted/.pins: requirements/kilted.txt
$(LOWER)/.pins: requirements/lower-bounds.txt

# The package goes in editable: what runs is what stands in this folder.
$(READY): %/.ready: %/.pins setup.py setup.cfg
	@$(PIP_INSTALL) --no-build-isolation --editable .
	@touch '$@'

# Every pin again, newest versions, one file for Python 3.10 to 3.13.
COMPILE = .venv-lock/bin/uv pip compile --quiet --universal --python-version 3.10 --upgrade \
	--no-header --no-emit-index-url --no-emit-find-links --extra test setup.py
define LOCK
@$(COMPILE) $(2) --output-file requirements/$(1).new
@{ echo '# Written by `make lock`: complete, for Python 3.10 to 3.13. Do not edit.'; \
  cat requirements/$(1).new; } > requirements/$(1).txt
@rm requirements/$(1).new
@echo 'requirements/$(1).txt'
endef

lock: check-python  ## pin all requirements anew
	@test -x .venv-lock/bin/uv || { '$(PYTHON)' -m venv .venv-lock && \
	  .venv-lock/bin/python -m pip install --quiet --disable-pip-version-check uv==$(UV_VERSION); }
	$(call LOCK,jazzy,--extra jazzy requirements/tools.in)
	$(call LOCK,kilted,--extra kilted requirements/tools.in)
	$(call LOCK,lower-bounds,--extra jazzy requirements/lower-bounds.in requirements/tools.in)

clean:  ## remove the environments and caches
	rm -rf .venv .venv-kilted .venv-lower-bounds .venv-lock .hypothesis .mypy_cache .pytest_cache \
	  .ruff_cache .import_linter_cache build *.egg-info
