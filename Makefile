# Every target goes through environment/run, which sets DOLFINx and the rest up when first needed.
run := environment/run
# Test files side by side; each process computes with one thread.
side_by_side := --numprocesses auto --maxprocesses 4 --dist loadfile

.DEFAULT_GOAL := help
.PHONY: help demo paper test test-slow test-timing test-parallel test-sid test-sid-all bench bench-large lint format image clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile

demo: ## run cases/demo.toml and draw it
	$(run) gapbeam run cases/demo.toml --overwrite
	$(run) gapbeam plot results/demo
	$(run) gapbeam render results/demo
	@echo "The pictures are in results/demo:" && find results/demo -name '*.png' -o -name '*.mp4' | sort

paper: ## the paper behind gapbeam, computed again, as one report: about 20 minutes
	$(run) gapbeam paper

test: ## the tests but the slow ones, on up to four cores
	$(run) pytest $(side_by_side)

test-slow: ## the slow tests: half an hour; minutes=10: those that end in 10 minutes, the others are named
	$(run) pytest $(side_by_side) -m "slow and not timing" $(if $(minutes),--within $(minutes))

test-timing: ## tests that compare wall times; for a machine that does nothing else
	$(run) pytest -m timing

test-parallel: ## the tests on two ranks
	$(run) mpirun -n 2 python3 -m mpi4py -m pytest -p no:cacheprovider

test-sid: ## the tests that depend on releases, with the DOLFINx of Debian sid
	GAPBEAM_SUITE=sid $(run) pytest $(side_by_side) -m "versions and not slow"

test-sid-all: ## the tests but the slow ones, with the DOLFINx of Debian sid
	GAPBEAM_SUITE=sid $(run) pytest $(side_by_side)

bench: ## speed, accuracy and memory beside others, into results/bench: a quarter of an hour
	$(run) python3 -m benchmarks

bench-large: ## up to a million unknowns, whole cases predicted, which mesh an answer needs
	$(run) python3 -m benchmarks --large

lint: ## style, types and scripts
	$(run) ruff check
	$(run) ruff format --check
	$(run) mypy
	$(run) shellcheck .ci/run environment/run environment/image environment/steps/*.sh environment/slurm/*.sbatch

format: ## format the Python files
	$(run) ruff format
	$(run) ruff check --fix

image: ## build the container image and try it, without a daemon
	environment/image

clean: ## remove what tests and tools leave behind; results stay
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
