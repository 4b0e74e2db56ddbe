# GLoTouch-BT. `make demo` and `make test` need python3 (3.11 or newer), make and nothing else.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export MPLBACKEND := Agg

.PHONY: demo dev test test-integration test-studies test-browser check format docs reference results-page pins clean

demo: $(VENV)
	$(BIN)/glotouch run retrieve --set target=apple --seed 0
	@echo "next: source $(BIN)/activate, then: glotouch run calibrate --live"

# Quick tests: no whole mission in MuJoCo, no browser.
test: $(VENV)/.dev $(VENV)/.compiled
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not study" --ignore=tests/integration --ignore=tests/browser

# Whole missions, backends and conformance in MuJoCo and on simulated devices, for which some tests wait.
test-integration: $(VENV)/.dev $(VENV)/.compiled
	$(BIN)/python -m pytest -n 3 --dist worksteal -m "not study" tests/integration

# Slow tests, among them whole benches on a small scale: minutes that show little more than the tests of their parts. Then the
# properties of which `make test` tries fewer examples. Not in .ci/run.
PROPERTIES = $(shell grep -rlE "support.examples import|preempt_all_along" tests --include="test_*.py")
test-studies: $(VENV)/.dev $(VENV)/.compiled
	$(BIN)/python -m pytest -n 2 --dist worksteal -m study
	GLOTOUCH_ALL_EXAMPLES=1 $(BIN)/python -m pytest -n 2 --dist worksteal -m "not study" $(PROPERTIES)

# The pages in Chromium: needs chromium and chromium-driver (Debian's packages). One at a time: beside a second window, which draws in
# software too, a picture can take longer than the driver waits.
test-browser: $(VENV)/.dev $(VENV)/.compiled
	GLOTOUCH_REQUIRE_BROWSER=1 $(BIN)/python -m pytest tests/browser

check: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The environment with the `glotouch` command and pytest, for tests of missions: `make .venv`.
$(VENV): requirements.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Python 3.11 or newer is needed: make PYTHON=python3.11")'
	rm -rf $(VENV)
	@echo "installing into $(VENV): one to three minutes"
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.txt
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $(VENV)

# These files are inside the environment and are deleted with it. Its folder is order-only: its time changes with every file made in it.
$(VENV)/.dev: requirements.txt pyproject.toml requirements-dev.txt | $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-dev.txt
	touch $(VENV)/.dev

# The machine code of the numerical loops: tests that start many processes would compile it in each. It needs nothing of .dev.
$(VENV)/.compiled: requirements.txt pyproject.toml | $(VENV)
	$(BIN)/python tests/support/compile_all.py
	touch $(VENV)/.compiled

# Everything that development needs, pytest included.
dev: $(VENV)/.dev

format:
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# The documentation as a site in build/site; a broken link is an error. Open build/site/index.html, no server needed.
docs: $(VENV)/.dev
	$(BIN)/python docs/generate --check
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# The pages of docs/reference and the generated sections, from the code; docs/results.md, from docs/results/*/summary.json.
reference: $(VENV)/.dev
	$(BIN)/python docs/generate reference architecture

# With DIR=FOLDER: first take over what `glotouch bench all --out FOLDER` measured.
results-page: $(VENV)/.dev
	$(if $(DIR),$(BIN)/glotouch bench all --out $(DIR) --collect docs/results)
	$(BIN)/python docs/generate results

# Renew the pinned, hashed requirements (no registry address is written).
PIP_COMPILE = $(BIN)/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras --no-emit-options --no-header
pins: $(VENV)/.dev
	$(PIP_COMPILE) --build-deps-for editable --extra test --extra view -o requirements.txt pyproject.toml
	$(PIP_COMPILE) --build-deps-for editable --extra dev -c requirements.txt -o requirements-dev.txt pyproject.toml
	$(PIP_COMPILE) -o tests/support/btcpp/requirements.txt tests/support/btcpp/requirements.in

clean:
	rm -rf $(VENV) build dist *.egg-info
