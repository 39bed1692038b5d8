# Everything sets itself up: a virtual environment with pinned wheels, on x86-64 Linux with
# Python 3.11 to 3.13. On a ROS 2 installation use colcon instead; see README.md.

PYTHON ?= python3
CLIMBERS ?=
CONFIG ?= config/$(if $(CLIMBERS),four_climbers,paper).yaml
CLOCK ?= sim
OUTPUT ?= demo_output/$(basename $(notdir $(CONFIG)))-$(CLOCK)-$(shell date +%Y%m%d-%H%M%S)
PAPER_OUTPUT ?= demo_output/paper
CAMPAIGN ?= config/campaign.yaml
CAMPAIGN_OUTPUT ?= demo_output/$(basename $(notdir $(CAMPAIGN)))
VENV := .venv
BIN := $(VENV)/bin
SET_UP := $(VENV)/set-up

.PHONY: demo paper campaign docs bench test lint unit coverage soak colcon clean

demo: $(SET_UP)
	@exec $(BIN)/run_demo --with-parent --config $(CONFIG) --clock $(CLOCK) --output $(OUTPUT) \
		$(if $(CLIMBERS),--climbers $(CLIMBERS))
	@$(BIN)/analyze_bag $(OUTPUT)/bag --params $(CONFIG) --output $(OUTPUT)

paper: $(SET_UP)
	@$(BIN)/reproduce_paper --output $(PAPER_OUTPUT)

# What was finished is kept: the same again goes on
campaign: $(SET_UP)
	@$(BIN)/campaign $(CAMPAIGN) --output $(CAMPAIGN_OUTPUT)

# The references of parameters, topics, services and metrics
docs: $(SET_UP)
	$(BIN)/python docs/generate.py

# Beside MuJoCo and Pinocchio, which are installed for it
bench: $(VENV)/bench
	@$(BIN)/python bench/all.py

$(VENV)/bench: $(SET_UP) bench/requirements.txt
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint requirements.txt \
		--requirement bench/requirements.txt
	touch $@

test: lint unit colcon

lint: $(SET_UP)
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy

# Five processes for two cores, as tests of nodes often wait; each has a ROS domain for each test.
# They begin with a fifth of the tests each, in their order; one that is ready helps another.
TESTS := -m pytest --numprocesses 5 --dist worksteal
# Of many hundred processes each would compile the package again
KEEPING_BYTECODE := env -u PYTHONDONTWRITEBYTECODE

unit: $(SET_UP)
	$(KEEPING_BYTECODE) $(BIN)/python $(TESTS)

# Which lines of the package the same tests go through, in all processes that they start
coverage: $(SET_UP)
	rm -f .coverage .coverage.*
	$(KEEPING_BYTECODE) $(BIN)/coverage run $(TESTS)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --sort cover --fail-under 95

# Longer tests than CI has time for
soak: $(SET_UP)
	$(BIN)/python -m pytest -m soak

# As in a ROS workspace: both ways to build, without a warning, and each node, started from there
colcon: $(SET_UP)
	rm -rf build install log
	. $(BIN)/activate && for how in "--symlink-install" ""; do rm -rf build install log && \
		$(KEEPING_BYTECODE) colcon build --packages-select climber_uk $$how \
		--event-handlers console_cohesion+ && ! grep . log/latest_build/climber_uk/stderr.log \
		|| exit 1; done
	. $(BIN)/activate && . install/setup.sh && $(KEEPING_BYTECODE) colcon test \
		--packages-select climber_uk --event-handlers console_cohesion+ \
		--return-code-on-test-failure --pytest-args --numprocesses 3 -m installed \
		$$(grep -l mark.installed test/nodes/test_*.py)
	. $(BIN)/activate && colcon test-result --all
	rm -rf build install log

$(SET_UP): requirements.txt setup.py
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --requirement requirements.txt
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation \
		evo==1.38.1 --editable . # evo without pandas and seaborn, 90 MB that the tests do not need
	touch $(SET_UP)

clean:
	rm -rf $(VENV) build install log demo_output
