PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: train test compile lint bench clean

$(VENV)/.installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

compile: $(VENV)/.installed ## all kernels, so that nothing after it compiles in silence
	$(BIN)/python -m hierroom.compile

train: compile ## HiPPO with the fixed depth-first meta-controller on graph c
	$(BIN)/python -m hierroom.train --meta fixed-dfs

test: compile ## everything CI runs
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/python -m pytest

lint: $(VENV)/.installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	$(BIN)/python benchmarks/world_speed.py

clean:
	rm -rf $(VENV)
