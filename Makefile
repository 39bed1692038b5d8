# Everything sets itself up: a virtual environment with pinned wheels, on x86-64 Linux with
# Python 3.11 to 3.13. On a ROS 2 installation use colcon instead; see README.md.
# `make help` tells what there is: each target with its line that begins with `##`.

PYTHON ?= python3
CLIMBERS ?=
CORNERS ?=
CONFIG ?= config/$(if $(CORNERS),lanes,$(if $(CLIMBERS),four_climbers,paper)).yaml
CLOCK ?= sim
OUTPUT ?= demo_output/$(basename $(notdir $(or $(CORNERS),$(CONFIG))))-$(CLOCK)-$(shell date +%Y%m%d-%H%M%S)
PAPER_OUTPUT ?= demo_output/paper
CAMPAIGN ?= config/campaign.yaml
CAMPAIGN_OUTPUT ?= demo_output/$(basename $(notdir $(CAMPAIGN)))
VENV := .venv
KILTED := .venv-kilted
SBOM := .venv-sbom
BIN := $(VENV)/bin
# What has been installed: for nodes, recorder and analysis; for tests, campaigns and benches too
SET_UP := $(VENV)/set-up
TOOLS := $(VENV)/tools-set-up
PIP := $(BIN)/pip install --quiet --disable-pip-version-check --no-compile
# One line of the terminal tells what pip is about; its errors stay, and so does its status
SHOWN := 2>&1; echo "ended $$?"; } | awk -v all=$$(grep -c == $(VENV)/demo.txt) \
	'/^ended / {status = $$2; next} /^ERROR|^error/ {bad = 1} \
	bad {print "\r" $$0} /^Installing/ {what = "installing"} \
	/^Collecting|^Processing/ {what = ++count " of " all ": " $$2} \
	what {printf "\r\033[K  %.70s", what; fflush(); what = ""} END {printf "\r\033[K"; exit status}'
# Exactly what requirements.txt has, to the last bit
EXACTLY := --no-deps --no-build-isolation --require-hashes --requirement

$(foreach name,config clock climbers corners output,$(if $(filter command,$(origin $(name))),\
	$(error $(name)= is not heeded: its name is in capitals)))

.PHONY: demo help paper campaign docs bench physics test lint unit coverage soak colcon clean test-kilted sbom

## run the nodes, and tell how well; CONFIG=config/climber.yaml, CLOCK=wall, CLIMBERS=4, CORNERS=my.csv
demo: $(SET_UP)
	@exec $(BIN)/run_demo --with-parent --config "$(CONFIG)" --clock $(CLOCK) --output "$(OUTPUT)" \
		$(if $(CLIMBERS),--climbers $(CLIMBERS)) $(if $(CORNERS),--corners "$(CORNERS)")
	@$(BIN)/analyze_bag "$(OUTPUT)/bag" --params "$(CONFIG)" --output "$(OUTPUT)"

help:
	@awk '/^##/ {line = substr($$0, 4)} /^[a-z-]+:/ && line {split($$1, name, ":"); \
		printf "make %-11s %s\n", name[1], line; line = ""}' $(MAKEFILE_LIST)

## the paper's figures and numbers
paper: $(SET_UP)
	@$(BIN)/reproduce_paper --output $(PAPER_OUTPUT)

## many runs with random climbers; the same again goes on where it was
campaign: $(TOOLS)
	@$(BIN)/campaign $(CAMPAIGN) --output $(CAMPAIGN_OUTPUT)

## the references of parameters, topics, services and metrics
docs: $(SET_UP)
	$(BIN)/python docs/generate.py

## speed and accuracy beside others', which are installed for it
bench: $(VENV)/bench
	@$(BIN)/python bench/all.py

## our plant beside MuJoCo, which is installed for it
physics: $(VENV)/physics
	@$(BIN)/python bench/physics.py

$(VENV)/physics: $(SET_UP) bench/requirements.txt
	$(PIP) --constraint bench/requirements.txt mujoco
	touch $@

$(VENV)/bench: $(TOOLS) bench/requirements.txt
	sed 's/ --hash.*//' requirements.txt > $(VENV)/constraints.txt # else these would need hashes
	$(PIP) --constraint $(VENV)/constraints.txt --requirement bench/requirements.txt
	touch $@

## all that CI runs: unit, and beside it lint and then colcon
test: $(TOOLS)
	@$(MAKE) --no-print-directory --jobs 2 unit lint colcon

## ruff, mypy and the spelling
lint: $(TOOLS)
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/codespell *.md docs climber_uk config examples launch bench test

# Four processes for two cores, as tests of nodes often wait; each has a ROS domain for each test.
# They begin with a quarter of the tests each, in their order; one that is ready helps another.
TESTS := -m pytest --numprocesses 4 --dist worksteal
# Of many hundred processes each would compile the package again
KEEPING_BYTECODE := env -u PYTHONDONTWRITEBYTECODE

## the tests, in four processes
unit: $(TOOLS)
	$(KEEPING_BYTECODE) $(BIN)/python $(TESTS)

## which lines of the package the tests go through, in all processes that they start
coverage: $(TOOLS)
	rm -f .coverage .coverage.*
	$(KEEPING_BYTECODE) $(BIN)/coverage run $(TESTS)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --sort cover --fail-under 95

## the tests by ROS 2 Kilted in place of Jazzy, in an environment of its own
test-kilted: $(KILTED)/set-up
	ROS_DISTRO=kilted $(KEEPING_BYTECODE) $(KILTED)/bin/python $(TESTS)

$(KILTED)/set-up: requirements.txt setup.py
	$(PYTHON) -m venv $(KILTED)
	sed '/^ros-/d; /^evo/d; s/ --hash.*//' requirements.txt > $(KILTED)/requirements.txt
	$(KILTED)/bin/pip install --quiet --requirement $(KILTED)/requirements.txt \
		'ros-kilted-rclpy[fastrtps]==9.1.2' ros-kilted-common-interfaces==5.5.1
	$(KILTED)/bin/pip install --quiet --no-deps --no-build-isolation evo==1.38.1 --editable .
	touch $@

## sbom.json: all that .venv has, with versions and licences, in CycloneDX's form
sbom: $(SET_UP) $(SBOM)/set-up
	$(SBOM)/bin/cyclonedx-py environment --output-reproducible --output-file sbom.json \
		$(BIN)/python

$(SBOM)/set-up:
	$(PYTHON) -m venv $(SBOM)
	$(SBOM)/bin/pip install --quiet --disable-pip-version-check cyclonedx-bom==7.5.0
	touch $@

## longer tests than CI has time for
soak: $(TOOLS)
	$(PIP) --constraint bench/requirements.txt numba
	$(BIN)/python -m pytest -m soak

## as in a ROS workspace: build without a warning, and each node, started from there
colcon: $(TOOLS)
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
	@echo "Setting up $(VENV), once: ROS 2, numpy, scipy, matplotlib; 150 MB to fetch, 500 on the disk, 1 to 2 minutes"
	@$(PYTHON) -m venv $(VENV)
	@grep '^setuptools' requirements.txt > $(VENV)/first.txt
	@sed '/^# For tests/,$$d' requirements.txt > $(VENV)/demo.txt
	@$(PIP) $(EXACTLY) $(VENV)/first.txt
	@{ $(subst --quiet,,$(PIP)) $(EXACTLY) $(VENV)/demo.txt $(SHOWN)
	@$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

$(TOOLS): requirements.txt setup.py
	$(PYTHON) -m venv $(VENV)
	grep '^setuptools' requirements.txt > $(VENV)/first.txt
	$(PIP) $(EXACTLY) $(VENV)/first.txt
	split --number=r/2 requirements.txt $(VENV)/half- # all that is needed is in it; of evo not pandas and seaborn
	ls $(VENV)/half-* | xargs -P 2 -n 1 $(PIP) $(EXACTLY)
	$(PIP) --no-deps --no-build-isolation --editable .
	touch $(SET_UP) $@

## remove what the others made
clean:
	rm -rf $(VENV) $(KILTED) $(SBOM) sbom.json build install log demo_output
