PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
LOCK := pip-compile --quiet --generate-hashes --no-emit-options --no-header --strip-extras --allow-unsafe

.DEFAULT_GOAL := help
.PHONY: help setup demo test lint bench experiments hooks lock clean

help:  ## say what can be made
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(STAMP)  ## make .venv with the locked dependencies

$(STAMP): requirements-dev.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed: make PYTHON=python3.11 ..." if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements-dev.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $(STAMP)

demo: setup  ## fly the demo with and without avoidance and compare
	$(BIN)/wideberth run scenarios/adsb_crossing.toml --out out/demo/no-avoidance --no-avoidance
	$(BIN)/wideberth run scenarios/adsb_crossing.toml --out out/demo/avoidance
	$(BIN)/wideberth compare out/demo/no-avoidance out/demo/avoidance

lint: setup  ## style, types and the import contracts
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

# The first pass runs the kernels as plain Python: it sees what a compiler hides, and measures their coverage.
# The kernels are compiled meanwhile, on one core. One process more than cores: flights in real time mostly wait.
test: setup  ## lint, the kernels' tests without the compiler, then every test
	$(BIN)/wideberth warmup & warm=$$!; \
	$(MAKE) --no-print-directory lint \
	  && NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -n 2 -q -m kernels --cov --cov-report=term --durations=12; \
	status=$$?; wait $$warm && exit $$status
	$(BIN)/python -m pytest -n 3 --dist worksteal --durations=12

# Without BlueSky all other benchmarks still run.
bench: setup  ## measure, beside BlueSky too; results go to benchmarks/results
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --require-hashes -r requirements-bench.lock
	$(BIN)/wideberth warmup
	$(BIN)/python -m benchmarks.run

experiments: setup  ## every study in full, hours; 50 missions in a recording with TRAFFIC=... SEED=...; results go to docs/results
	$(BIN)/wideberth warmup
	rm -rf out/monte_carlo
	WIDEBERTH_FULL_COUNTS=1 $(BIN)/python -m pytest -q tests/scenario/test_no_flip_flop.py tests/scenario/test_montecarlo_tiers.py
	$(BIN)/python -m experiments.monte_carlo
	$(BIN)/python -m experiments.radar_estimators
	$(BIN)/python -m experiments.plot_model_fit
	$(BIN)/python -m experiments.fusion_consistency docs/results/fusion_consistency.md
	$(BIN)/python -m experiments.tracker_benchmark docs/results/tracker_benchmark.md
	$(BIN)/python -m experiments.close_pairs
	$(BIN)/python -m experiments.cas_encounters
	$(BIN)/python -m experiments.ground_radar
	$(BIN)/python -m experiments.scenario_table
	$(BIN)/python -m experiments.live_soak
	$(BIN)/python -m experiments.live_flight_test
	$(BIN)/python -m experiments.live_head_on
	$(BIN)/python -m experiments.live_faults
	$(BIN)/python -m experiments.real_traffic_missions $(if $(TRAFFIC),--traffic $(TRAFFIC)) $(if $(SEED),--seed $(SEED))

hooks: setup  ## run the linters before each commit
	$(BIN)/pre-commit install

lock:  ## renew the lock files (needs pip-tools)
	$(LOCK) --output-file requirements.lock pyproject.toml
	$(LOCK) --extra test --constraint requirements.lock --output-file requirements-dev.lock pyproject.toml
	$(LOCK) --extra bench --constraint requirements-dev.lock --output-file requirements-bench.lock pyproject.toml

clean:  ## remove what was made, except .venv
	rm -rf out build .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis .coverage
