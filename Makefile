# make demo, make test: each creates .venv if needed, installs what it uses (an extra of pyproject.toml), and runs.
# Only files with a known hash are installed (requirements/), and nothing is built but the product itself.
# make alone only installs the product; make help lists the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
INSTALL := $(BIN)/pip install --quiet --disable-pip-version-check --no-deps
HASHED := --require-hashes --requirement
DEMO_ARGS ?=
# REPEAT=--last-failed repeats only what failed, in each of the test targets; parts of them then run in turn.
REPEAT ?=
PYTEST = $(BIN)/python -m pytest $(REPEAT)
jobs = --jobs $(if $(REPEAT),1,$(1)) --keep-going --output-sync=none

INTEROP := .interop
PARTS := waiting-1 waiting-2 units others
COVERAGE := $(PARTS:%=.pytest_cache/coverage-%.json)
# Fast tests that wait for sockets, processes or time, in two halves side by side; all others compute, and take what
# they leave. Each file has loopback addresses of its own.
WAITING_1 := $(wildcard tests/contract/test_*.py) tests/contract/ardrone_driver tests/replay/test_replay_playback.py tests/sitl
WAITING_2 := tests/contract/mavlink_links tests/unit/console tests/unit/supervisor tests/unit/cli/test_cli_stop.py \
	tests/unit/cli/test_cli_bench_report.py tests/unit/drivers/tello/test_tello_video.py

.PHONY: help install demo test test-waiting-1 test-waiting-2 test-units test-others raise-floors test-slow slow-flights slow-pages-1 slow-pages-2 slow-scenarios slow-studies slow-largest test-exhaustive fuzz test-firmware mutants limiter-states wire-faults soak check format docs hashes sbom audit interop clean

install: $(STAMP)  ## the product, in .venv, with compiled kernels (also: make alone)

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-16s %s\n", $$1, $$2 }' Makefile

demo: $(STAMP)  ## one flight in the simulator; DEMO_ARGS=...
	$(BIN)/groundstation demo $(DEMO_ARGS)

# Tests that wait (for sockets, processes, time) run in two halves, the first printed as it runs, those that compute
# beside them in two parts of lower priority. What runs is measured, and each package has a floor
# (tests/coverage/floors.toml); make raise-floors raises them.
test: $(STAMP)-test  ## the fast tests
	$(MAKE) $(call jobs,4) $(PARTS:%=test-%)
	$(BIN)/python tests/coverage/floors.py $(COVERAGE)

test-waiting-1: $(STAMP)-test
	COVERAGE_DATA=.pytest_cache/coverage-waiting-1.json $(PYTEST) -m "not slow" $(WAITING_1)

# Kernels that only the planar planner has take a minute to compile: one of the parts waits for them.
PLANAR := $(wildcard tests/*/test_planar_*.py)
COMPUTED := $(addprefix --ignore=,$(WAITING_1) $(WAITING_2))
test-waiting-2: FAST = $(WAITING_2)
test-units: FAST = $(COMPUTED) tests/unit $(PLANAR)
test-others: FAST = $(COMPUTED) --ignore=tests/unit $(PLANAR:%=--ignore=%) tests
test-units test-others: BESIDE = .ci/background
test-waiting-2 test-units test-others: test-%: $(STAMP)-test
	@mkdir -p .pytest_cache/$* && code=0; \
	COVERAGE_DATA=.pytest_cache/coverage-$*.json $(BESIDE) $(PYTEST) -m "not slow" -o cache_dir=.pytest_cache/$* $(FAST) \
		>.pytest_cache/$*/log 2>&1 || code=$$?; \
	cat .pytest_cache/$*/log; exit $$code

raise-floors: $(STAMP)-test  ## set the coverage floors to the last run's figures
	$(BIN)/python tests/coverage/floors.py $(COVERAGE) --raise

# Flights are judged by the clock: what only computes runs beside them, where they leave time, and is printed at its end.
# Pages are judged by how soon they show what they are told: they follow, in two halves. The largest flights fill two
# slow cores and have them to themselves.
test-slow: $(STAMP)-test-slow  ## flights in real time, browser, programs of other projects; make interop first
	code=0; $(MAKE) $(call jobs,3) slow-flights slow-scenarios slow-studies || code=$$?; \
	$(MAKE) $(call jobs,2) slow-pages-1 slow-pages-2 || code=$$?; \
	$(MAKE) slow-largest && exit $$code

slow-flights: $(STAMP)-test-slow
	$(PYTEST) -m "slow and not page and not study and not largest and not firmware and not exhaustive" --timeout 900 tests

slow-largest: $(STAMP)-test-slow
	$(PYTEST) -m "largest and not exhaustive" --timeout 900 -o cache_dir=.pytest_cache/largest tests/sitl

slow-pages-1: SLOW = "page and not exhaustive" $(wildcard tests/browser/test_browser_[a-l]*.py)
slow-pages-2: SLOW = "page and not exhaustive" $(wildcard tests/browser/test_browser_[m-z]*.py)
slow-scenarios: SLOW = "study and not exhaustive" tests/scenario
slow-studies: SLOW = "study and not exhaustive" --ignore=tests/scenario --ignore=tests/browser --ignore=tests/sitl tests
slow-scenarios slow-studies: BESIDE = .ci/background
slow-pages-1 slow-pages-2 slow-scenarios slow-studies: slow-%: $(STAMP)-test-slow
	@mkdir -p .pytest_cache/$* && code=0; \
	$(BESIDE) $(PYTEST) --timeout 1800 -o cache_dir=.pytest_cache/$* -m $(SLOW) >.pytest_cache/$*/log 2>&1 || code=$$?; \
	cat .pytest_cache/$*/log; exit $$code

# More cases of what test-slow shows, e.g. every flight of each kind of vehicle, and the long recordings: two hours.
test-exhaustive: $(STAMP)-test-slow  ## more cases of these: two hours
	$(PYTEST) -m "exhaustive and not firmware" --timeout 3000 tests

# Real firmware: the SITL binaries that $$SKEIN_PX4 and $$SKEIN_ARDUCOPTER name. Stand-ins for them fly in test-slow.
test-firmware: $(STAMP)-test-slow  ## flights of real firmware (SKEIN_PX4, SKEIN_ARDUCOPTER)
	$(PYTEST) -m firmware --timeout 900 tests

# Damaged inputs for every decoder: COUNT of each (test-slow: 30 000; field files 6000). DECODER=navdata, at, pave, ... takes one.
fuzz: $(STAMP)-test  ## damaged inputs for every decoder; COUNT=N DECODER=NAME
	FUZZ_INPUTS=$(or $(COUNT),1000000) nice $(PYTEST) -m fuzz --timeout 7200 -k "many_damaged $(if $(DECODER),and $(DECODER))" tests/property

# Whether tests notice changed code. MODULES names parts of paths in tests/mutation/targets.toml, e.g. make mutants MODULES="watchdog lease".
# All take hours: PART=K/N judges every N-th mutant, for 20 minutes at most.
mutants: $(STAMP)-test  ## whether tests notice changed code; MODULES=... PART=K/N
	nice $(BIN)/python tests/mutation/run.py $(MODULES) --part $(or $(PART),1/1) --seconds 1200 $(MUTANTS_ARGS)

# Kills and freezes of each process and of each pair of processes in flight: 200 flights of some 35 s. PART=K/N flies a part, e.g. PART=1/6.
wire-faults: $(STAMP)-test  ## kills and freezes of processes in flight; PART=K/N
	$(BIN)/python tests/sitl/wire_campaign.py --part $(or $(PART),1/1) $(WIRE_ARGS)

# The output limiter in random states: ten million take 35 minutes of a core. STATES=N, SEED=N.
limiter-states: $(STAMP)-test  ## the output limiter in random states; STATES=N SEED=N
	nice $(BIN)/python tests/property/limiter_states.py --states $(or $(STATES),10000000) --seed $(or $(SEED),2)

# Memory of every process over a long flight.
soak: $(STAMP)-test  ## memory of every process over a long flight; MINUTES=N
	$(BIN)/python tests/sitl/soak.py --minutes $(or $(MINUTES),30)

check: $(STAMP)-check  ## ruff, mypy, import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(STAMP)-check  ## format the sources
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(STAMP)-docs  ## the documentation as a site
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

# After a change of a pin: the hashes of all files of each pinned release, from the registry; needs uv.
hashes:  ## hashes of all pinned libraries
	$(PYTHON) .ci/pin_hashes.py

# The bill of materials of what is installed and needed to run.
sbom: $(STAMP)  ## bill of materials
	$(BIN)/python .ci/supply_chain.py build/sbom.cdx.json

# Known faults of the pinned libraries; needs pip-audit and a database in reach, and says so where they are missing.
audit: $(STAMP)  ## known faults of the pinned libraries
	@command -v pip-audit >/dev/null || { echo "audit skipped: pip-audit is not installed (pipx install pip-audit)"; exit 0; }; \
	pip-audit --no-deps --disable-pip --requirement constraints.txt; code=$$?; \
	test $$code -ne 2 || { echo "audit skipped: no database of vulnerabilities is in reach"; exit 0; }; exit $$code

# Clients by other projects for the interoperability tests, each in an environment of its own.
interop: $(patsubst %,$(INTEROP)/%/.installed,node pyardrone mavproxy dronekit zenoh_ros2)  ## clients by other projects, for test-slow

$(INTEROP)/node/.installed: tests/interop/package.json
	@command -v npm >/dev/null || { echo "npm is missing: the tests with npm ar-drone are skipped without it"; exit 1; }
	@mkdir -p $(INTEROP)/node && cp $< $(INTEROP)/node/package.json
	cd $(INTEROP)/node && npm install --no-package-lock --ignore-scripts --no-audit --no-fund --loglevel=error
	@touch $@

$(INTEROP)/%/.installed: tests/interop/%.txt
	@test -x $(INTEROP)/$*/bin/python || $(PYTHON) -m venv $(INTEROP)/$*
	$(INTEROP)/$*/bin/pip install --quiet --disable-pip-version-check --no-deps $(HASHED) $<
	@mkdir -p $(INTEROP)/bin && for program in $(INTEROP)/$*/lib/python3*/site-packages/imageio_ffmpeg/binaries/ffmpeg-*; do \
		test ! -x "$$program" || ln -sf "$$(pwd)/$$program" $(INTEROP)/bin/ffmpeg; done
	@touch $@

$(STAMP): pyproject.toml requirements/run.txt
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(0 if v >= (3, 11) else "Skein needs Python 3.11 or newer; this is %d.%d. Use: make PYTHON=python3.11 $(MAKECMDGOALS)" % v[:2])'
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) --only-binary :all: $(HASHED) requirements/run.txt
	$(INSTALL) --no-build-isolation --editable .
	@echo "compiling the kernels, once: a minute or two"
	@$(BIN)/python -m groundstation.runtime.compile_kernels
	@touch $@

$(STAMP)-%: $(STAMP) requirements/%.txt
	$(INSTALL) --only-binary :all: $(HASHED) requirements/$*.txt
	@touch $@

clean:  ## remove the environments and all that was built
	rm -rf $(VENV) $(INTEROP) docs/_build .mypy_cache .ruff_cache .pytest_cache .numba_cache
