# Every target goes through environment/run, which sets DOLFINx and the rest up when first needed.
run := environment/run
# Test files side by side; each process computes with one thread. A test that ends its process is not run again.
side_by_side := --numprocesses auto --maxprocesses 4 --dist loadfile --max-worker-restart 0

.DEFAULT_GOAL := help
.PHONY: help demo test test-slow test-pages test-timing test-parallel test-sid test-sid-all test-wheel test-wheel-oldest bench bench-large docs joss docs-run gallery lint format image clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile

demo: ## run cases/demo.toml and draw it
	$(run) gapbeam run cases/demo.toml --overwrite
	$(run) gapbeam plot results/demo
	$(run) gapbeam render results/demo
	@echo "The pictures are in results/demo:" && find results/demo -name '*.png' -o -name '*.mp4' -o -name '*.gif' | sort


test: ## the tests but the slow ones, on up to four cores
	$(run) pytest $(side_by_side)

test-slow: ## the slow tests: half an hour; minutes=10: what ends in 10 minutes; longest=0.5: each test at most half a minute
	$(run) pytest $(side_by_side) -m "slow and not timing" $(if $(minutes),--within $(minutes)) $(if $(longest),--longest $(longest))

test-pages: ## every command and program of README, tutorials and how-to pages, as it stands: a quarter of an hour
	$(run) pytest $(side_by_side) --dist load -m slow -k test_pages_run_as_they_stand tests/regression/test_page_execution.py

test-timing: ## tests that compare wall times; for a machine that does nothing else
	$(run) pytest -m timing

test-parallel: ## the tests on two ranks
	$(run) mpirun -n 2 python3 -m mpi4py -m pytest -p no:cacheprovider

test-sid: ## the tests that depend on releases, with the DOLFINx of Debian sid
	GAPBEAM_SUITE=sid $(run) pytest $(side_by_side) -m "versions and not slow"

test-sid-all: ## the tests but the slow ones, with the DOLFINx of Debian sid
	GAPBEAM_SUITE=sid $(run) pytest $(side_by_side)

test-wheel: ## the tests where pip alone installed gapbeam, newest releases: bare Debian 13, ordinary user, no compiler
	environment/wheel $(side_by_side)

test-wheel-oldest: ## the same with the oldest releases that pyproject.toml takes
	environment/wheel --oldest $(side_by_side)

bench: ## speed, accuracy and memory beside others, into results/bench: a quarter of an hour
	$(run) python3 -m benchmarks

bench-large: ## up to a million unknowns, whole cases predicted, which mesh an answer needs
	$(run) python3 -m benchmarks --large

docs: ## the documentation as a site, in build/docs; its Python packages go into build/docs-venv
	test -x build/docs-venv/bin/sphinx-build || python3 -m venv build/docs-venv
	build/docs-venv/bin/pip install --quiet --disable-pip-version-check -r docs/site/requirements-docs.txt
	PYTHONDONTWRITEBYTECODE=1 build/docs-venv/bin/python -m docs.site build/docs
	@echo "Open build/docs/index.html"

joss: ## the paper for the Journal of Open Source Software, build/joss/paper.pdf; its tools go into build/joss-venv
	test -x build/joss-venv/bin/pip || python3 -m venv build/joss-venv
	build/joss-venv/bin/pip install --quiet --disable-pip-version-check -r docs/joss/requirements-joss.txt
	PYTHONDONTWRITEBYTECODE=1 build/joss-venv/bin/python -m docs.joss build/joss/paper.pdf

docs-run: ## execute the commands and the Python of tutorials and how-to pages; pages="docs/how-to/sweep-keys.md" for some
	$(run) python3 -m docs.execution $(pages)

gallery: ## run the scenes of docs/gallery.md and draw them: a quarter of an hour
	$(run) python3 -m docs.gallery

lint: ## style, types and scripts
	$(run) ruff check
	$(run) ruff format --check
	$(run) mypy
	$(run) shellcheck .ci/run environment/run environment/image environment/wheel environment/build-kernel environment/steps/*.sh environment/container/*.sh environment/slurm/*.sbatch

format: ## format the Python files
	$(run) ruff format
	$(run) ruff check --fix

image: ## build the container image and try it, without a daemon
	environment/image

clean: ## remove what tests and tools leave behind; results stay
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
