# SPDX-License-Identifier: Apache-2.0
# make run     sets up an environment, then runs a scene as a ROS 2 node with a controller (SCENE=..., one with belts feeder and table; DISTRO=kilted)
# make test    sets up the same, then runs the tests (ARGS="-k bag" hands options to pytest, ARGS="-m quick" is the inner loop)
# make bench   sets up the same, then measures speed against others, about 40 minutes (ARGS="dense plant" or ARGS=--quick)
# make accuracy  sets up the same, then makes the studies of docs/accuracy.md, about an hour (ARGS=funnel for one)
# make promises  sets up the same, then holds all shipped scenes and fifteen unseen ones to the presets' promises, 5 to 25 minutes
# make defaults  sets up the same, then compares integrators, friction solvers and friction laws, a quarter of an hour (ARGS=push for one)
# make fuzz    sets up the same, then attacks with random input (ARGS="--minutes 60 --jobs 2"; --target bags for one; failures are kept)
# make validation  sets up the same, then compares with published experiments (docs/validation.md), at most an hour (ARGS=tipping for one)
# make stability  sets up the same, then runs the hard cases of docs/stability.md in all settings, about 15 minutes
# make numba-next  sets up the same, then runs the engine's tests on the newest numba that pip offers, pre-releases included
# make lint    style and types
# make docs-check  are the pages of docs/ that programs make up to date? make docs writes them anew
# make site    the pages of docs/ and the Python API as a web site in build/site; fails on a broken link
# make clean   removes what set-up and builds made, never runs/

DISTRO ?= jazzy
SCENE ?= config/paper_plant.yaml
VENV := $(if $(filter jazzy,$(DISTRO)),.venv,.venv-$(DISTRO))
PYTHON := $(VENV)/bin/python
# Four processes of tests on two cores: many wait for others. A module stays in one, for its tests share nodes and what was compiled.
# test/conftest.py says what one of them takes whole, and what they begin with.
SIDE_BY_SIDE := --numprocesses=4 --dist=loadfile --no-loadscope-reorder

# The environment is private: nothing of a sourced ROS, nor of another environment of ROS wheels, may reach it.
ifneq ($(AMENT_PREFIX_PATH)$(ROS_DISTRO)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport LD_LIBRARY_PATH
endif
unexport AMENT_PREFIX_PATH AMENT_CURRENT_PREFIX COLCON_PREFIX_PATH COLCON_CURRENT_PREFIX CMAKE_PREFIX_PATH
unexport PKG_CONFIG_PATH PYTHONPATH PYTHONHOME VIRTUAL_ENV
unexport ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Without bytecode on disk every process parses 350 files of ours anew, half a second of a core each: hundreds in the tests.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help run test bench accuracy promises defaults fuzz stability validation numba-next lint docs docs-check site clean set-up set-up-test set-up-bench set-up-docs set-up-ci

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile

run: set-up
	@$(PYTHON) -m conveyor_sim.ros.main_job "$(SCENE)"

test: set-up-test
	@$(PYTHON) -m pytest $(SIDE_BY_SIDE) $(ARGS)

bench: set-up-bench
	@$(PYTHON) -m bench $(ARGS)

accuracy: set-up
	@$(PYTHON) docs/studies/accuracy.py $(ARGS)

promises: set-up
	@$(PYTHON) docs/studies/promises.py $(ARGS)

defaults: set-up
	@$(PYTHON) docs/studies/defaults.py $(ARGS)

# Beside the tests, whose scenes and checks it uses.
fuzz: set-up-test
	@PYTHONPATH=.:test $(PYTHON) -m fuzz $(ARGS)

validation: set-up
	@$(PYTHON) docs/studies/validation/run.py $(ARGS)

stability: set-up
	@$(PYTHON) docs/studies/stability.py $(ARGS)

# Installed into a folder of its own that comes before the environment: the environment keeps its version.
numba-next: set-up-test
	@rm -rf build/numba-next
	@$(PYTHON) -m pip install --quiet --pre --target build/numba-next numba
	@PYTHONPATH="$(CURDIR)/build/numba-next" $(PYTHON) -c "import numba, llvmlite; print('numba', numba.__version__, 'llvmlite', llvmlite.__version__)"
	@PYTHONPATH="$(CURDIR)/build/numba-next" $(PYTHON) -m pytest test/engine $(ARGS)

lint: set-up-test
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m ruff format --check .
	@sh tools/ament_lint.sh $(VENV)/bin conveyor_sim launch examples tools
	@$(PYTHON) tools/check_prose.py
	@$(PYTHON) -m mypy

docs: set-up-test
	@$(PYTHON) tools/generated_pages.py --write

docs-check: set-up-test
	@$(PYTHON) tools/generated_pages.py

site: set-up-docs
	@$(PYTHON) -m sphinx --fail-on-warning --keep-going --quiet -c docs . build/site
	@echo "build/site/index.html"

set-up:
	@sh tools/set_up.sh "$(DISTRO)"

set-up-test:
	@sh tools/set_up.sh "$(DISTRO)" test

set-up-bench:
	@sh tools/set_up.sh "$(DISTRO)" bench

set-up-docs:
	@sh tools/set_up.sh "$(DISTRO)" docs

set-up-ci:
	@sh tools/set_up.sh "$(DISTRO)" test docs

clean:
	rm -rf .venv .venv-kilted build install log dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
