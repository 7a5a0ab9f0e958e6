# Two commands: `make demo` and `make test`. Both set up what they need; later runs skip what is done.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
export OMP_NUM_THREADS ?= 1

.PHONY: help demo demo-cheetah test test-default test-pages test-slow test-browser lab bench check fix clean
.DEFAULT_GOAL := help

help:  ## this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

$(VENV)/ready-base: pyproject.toml bootstrap.sh
	PYTHON=$(PYTHON) VENV=$(VENV) sh bootstrap.sh base

$(VENV)/ready-train: pyproject.toml bootstrap.sh
	PYTHON=$(PYTHON) VENV=$(VENV) sh bootstrap.sh train

$(VENV)/ready-dev: pyproject.toml bootstrap.sh
	PYTHON=$(PYTHON) VENV=$(VENV) sh bootstrap.sh train,lab,dev

demo: $(VENV)/ready-base  ## five fingers become two, and the hand goes on opening doors: live, with a film
	$(BIN)/python -m revolver_lab.demos.hand

demo-cheetah: $(VENV)/ready-train  ## an expert fails on a changed cheetah; Algorithm 1 carries it there, with a film
	$(BIN)/python -m revolver_lab.demos.cheetah

test: test-default test-pages  ## every claim of the package, in minutes

test-default: $(VENV)/ready-dev  ## what needs no notebook and no browser, in under three minutes
	$(BIN)/python -m pytest -q -n 2 --dist worksteal --ignore tests/test_browser.py tests revolver_lab

test-pages: $(VENV)/ready-dev  ## the notebooks, executed; and in JupyterLab where Chromium is present
	REVOLVER_LAB_MODE=fast $(BIN)/python -m pytest -q -n 2 --dist loadfile --nbmake --nbmake-timeout=300 tests/test_browser.py notebooks/*.ipynb

test-slow: $(VENV)/ready-dev  ## the claims that take longer
	$(BIN)/python -m pytest -q -m slow

test-browser: $(VENV)/ready-dev  ## the notebook in JupyterLab, by keyboard; installs Chromium
	command -v chromium >/dev/null || { apt-get update -qq && apt-get install -y -qq chromium; } || \
	    { echo "Chromium is missing. Run: sudo apt-get install -y chromium" && exit 1; }
	$(BIN)/python -m pytest -q tests/test_browser.py

lab: $(VENV)/ready-dev  ## JupyterLab
	$(BIN)/jupyter lab notebooks

bench: $(VENV)/ready-dev  ## every speed, as a ratio in one run, to out/benchmarks.json
	$(BIN)/python -m benchmarks

check: $(VENV)/ready-dev  ## format, lint, types
	$(BIN)/ruff format --check . && $(BIN)/ruff check . && $(BIN)/pyright

fix: $(VENV)/ready-dev  ## format and mend what can be mended
	$(BIN)/ruff format . && $(BIN)/ruff check --fix .

clean:  ## remove the virtual environment and everything written by runs
	rm -rf $(VENV) out build *.egg-info
