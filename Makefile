PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
INSTALLED := .venv/installed
TRAINS := .venv/trains
MEASURES := .venv/measures

.PHONY: help setup train-setup bench-setup demo test test-compose lint bench clean

help:
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 16

setup: $(INSTALLED) ## install into .venv, nothing else

$(INSTALLED): requirements/run.txt requirements/build.txt requirements/dev.txt pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

train-setup: $(TRAINS) ## torch besides, to train the networks of perception

$(TRAINS): $(INSTALLED) requirements/train.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/train.txt
	touch $@

bench-setup: $(MEASURES) ## gtsam besides, which benchmarks measure against

$(MEASURES): $(INSTALLED) requirements/bench.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/bench.txt
	touch $@

demo: setup ## drive around a simulated town; more options: make demo ARGS="--seed 2"
	$(BIN)/cogmap run $(ARGS)

test: setup ## every test but the one of the containers
	$(BIN)/python -m pytest

test-compose: setup ## build the containers and test them as they run
	$(BIN)/python -m pytest tests/compose -m compose --timeout 1200

lint: setup ## style, types, and who imports whom
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: setup ## every benchmark there is
	$(BIN)/python -m benchmarks cycle
	$(BIN)/python -m benchmarks bus
	$(BIN)/python -m benchmarks perception
	$(BIN)/python -m benchmarks spiking

clean: ## remove what was installed and built; runs stay
	rm -rf .venv build *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
