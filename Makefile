PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
INSTALLED := .venv/installed
TRAINS := .venv/trains
MEASURES := .venv/measures
RERUN := .venv/rerun
DOCUMENTS := .venv/documents
AUDITS := .venv/audits

.PHONY: help setup train-setup bench-setup rerun-setup demo test test-compose fuzz lint docs generated hashes sbom audit bench release clean

help:
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 16

setup: $(INSTALLED) ## install into .venv, nothing else

RUNS = import sys; sys.exit(sys.version_info < (3, 11))

$(INSTALLED): requirements/run.txt requirements/build.txt requirements/dev.txt pyproject.toml
	@$(PYTHON) -c '$(RUNS)' || { \
	    echo "It needs Python 3.11 or newer, and $(PYTHON) is older:" \
	        "name one with PYTHON=/path/to/python3, or use docker compose up" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

train-setup: $(TRAINS) ## torch besides (5 GB), to train the networks of perception and to test that

$(TRAINS): $(INSTALLED) requirements/train.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/train.txt
	touch $@

bench-setup: $(MEASURES) ## gtsam and scikit-learn besides, which benchmarks compare with

$(MEASURES): $(INSTALLED) requirements/bench.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/bench.txt
	touch $@

rerun-setup: $(RERUN) ## Rerun besides (500 MB), to test what is written for it

$(RERUN): $(INSTALLED) requirements/rerun.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/rerun.txt
	touch $@

# A battery that lasts for a minute or two of driving, so that a need rises while one watches.
LIVES = --energy --explore $$((60 * $(MINUTES))) --set 'sim.battery={capacity_s=400}'

demo: setup ## explore a simulated town and drive home; DASHBOARD=1 opens a browser that shows it, TOUR=1 for goals and a closed street, MINUTES=5 for a life with a battery, KEYS=1 for TLS with a certificate a process; ARGS="--seed 2" for more
	$(if $(KEYS),$(BIN)/cogmap keys make build/keys)
	$(BIN)/cogmap run$(if $(KEYS), --keys build/keys) $(if $(DASHBOARD),--open-dashboard,--dashboard) $(if $(TOUR),--tour,--town blocks $(if $(MINUTES),$(LIVES),--explore 45)) $(ARGS)

test: setup ## every test but those of the containers; those of training are skipped without torch
	$(BIN)/python -m pytest -n auto --dist loadfile --ignore tests/e2e --ignore tests/fault --cov --cov-report=
	$(BIN)/python -m pytest tests/e2e tests/fault
	@echo "lines covered by tests within one process: $$($(BIN)/coverage report --format=total) %;" \
	    "$(BIN)/coverage report --show-missing lists the others"

test-compose: setup ## build the containers and test them as they run
	$(BIN)/python -m pytest tests/compose -m compose --timeout 1200

fuzz: setup ## coverage-guided fuzzing by atheris, where it is installed; make fuzz ARGS="--seconds 600 NAME"
	$(BIN)/python -m tests.fuzz.targets $(ARGS)

lint: setup ## style, types, and which package imports which; needs no torch
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(DOCUMENTS) ## the documentation as a site, in build/docs; fails where a link leads nowhere
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "$(CURDIR)/build/docs/index.html"

$(DOCUMENTS): $(INSTALLED) requirements/docs.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/docs.txt
	touch $@

generated: setup ## what follows from the code: golden messages, tables and code in the docs
	$(BIN)/python -m cogmap.schemas.export --golden schemas/golden
	$(BIN)/cogmap architecture
	$(BIN)/python -m tests.support.includes

$(AUDITS): $(INSTALLED) requirements/audit.txt
	$(PYTHON) -m venv .venv/audit
	.venv/audit/bin/pip install --quiet --disable-pip-version-check -r requirements/audit.txt
	touch $@

AUDIT := .venv/audit/bin/python

hashes: $(AUDITS) ## requirements/run.hashes.txt, after a change of run.txt or build.txt; takes minutes
	$(AUDIT) -m tests.support.hashes

sbom: $(AUDITS) ## what the container installs, as CycloneDX, in build/sbom.json
	mkdir -p build
	.venv/audit/bin/cyclonedx-py requirements --output-reproducible --of JSON -o build/sbom.json requirements/run.hashes.txt

audit: $(AUDITS) ## known vulnerabilities of that; ends with 3 where no source of them can be reached
	$(AUDIT) -m tests.support.audit

bench: bench-setup ## every benchmark and experiment that has a threshold; make bench ARGS="--data DIR"
	$(BIN)/python -m benchmarks all $(ARGS)

release: setup ## check the version, style and tests, and tag the commit; CONTRIBUTING.md has the steps
	$(BIN)/python -m tests.support.release
	$(MAKE) lint test
	git tag --annotate --message "Cogmap $$($(BIN)/cogmap --version | cut -d' ' -f2)" \
	    v$$($(BIN)/cogmap --version | cut -d' ' -f2)

clean: ## remove what was installed and built; runs stay
	rm -rf .venv build *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .coverage*
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
