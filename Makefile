PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: train test test-all check results test-random test-lowest coverage mutate compile lint docs package bench constraints audit clean

$(VENV)/.installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

compile: $(VENV)/.installed ## all kernels, so that nothing after it compiles in silence
	$(BIN)/python -m hierroom compile

train: compile ## HiPPO with the fixed depth-first meta-controller on graph c
	$(BIN)/python -m hierroom train --meta fixed-dfs

check: $(VENV)/.installed ## ruff and pyright; nothing is changed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

test: $(VENV)/.installed ## ruff, pyright and the tests that guard a rule of the package
	$(MAKE) --no-print-directory --jobs=2 compile check
	$(BIN)/python -m pytest -n 2 --dist worksteal --durations=20 -m "not slow" --cases 2

test-all: $(VENV)/.installed ## everything, as CI runs it: slow tests, and a few mutants
	$(MAKE) --no-print-directory --jobs=2 compile check
	$(BIN)/python -m pytest -n 2 --dist worksteal --durations=20
	$(MAKE) --no-print-directory mutate MODULES="gae sampling --sample 20"

test-random: $(VENV)/.installed ## the tests in random order and in parallel; the seed is printed, SEED=n repeats it
	$(BIN)/python -m pytest --verbose -p randomly -n auto $(if $(SEED),--randomly-seed=$(SEED))

# Whose kernels no other test runs as plain Python, in which alone their lines are seen.
OF_KERNELS := tests/worlds/escape_room/test_state_check.py tests/worlds/escape_room/test_features.py \
	tests/complexity/chains/test_complexity_elimination.py tests/learners/test_learner_gae.py tests/learners/test_learner_kernels.py

coverage: $(VENV)/.installed ## which branches the tests take, of kernels as plain Python too; fails below 95%
	$(BIN)/coverage erase
	$(BIN)/coverage run -m pytest -n auto
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest -n auto -k "not its_own_source" $(OF_KERNELS)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report

mutate: compile ## small errors in some modules, each of which their tests must notice; MODULES="gae ledger" names some
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[mutation]'
	$(BIN)/python -m tests.mutation $(MODULES)

lint: $(VENV)/.installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/.installed ## the docs as a site, site/index.html
	$(BIN)/mkdocs build --strict

package: $(VENV)/.installed ## the source distribution and the wheel, in dist/
	$(BIN)/python -m build --outdir dist

results: compile ## the statistics, tables and pictures of README and docs anew, from the rows in benchmarks/results
	$(BIN)/python -m benchmarks.page_statistics
	$(BIN)/python -m benchmarks.tables
	$(BIN)/python -m benchmarks.figures

bench: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	$(BIN)/python benchmarks/world_speed.py

TOOLS := $(VENV)-tools
UV := $(TOOLS)/bin/uv
# clients, ray, benchmarl and agilerl pin others so that they need environments of their own.
COMPILE := $(UV) pip compile --quiet --universal --python-version 3.11 --no-annotate --extra dev --extra docs --extra bench --extra mutation

$(TOOLS)/.installed: Makefile
	$(PYTHON) -m venv $(TOOLS)
	$(TOOLS)/bin/pip install --quiet --disable-pip-version-check uv==0.13.9 pip-audit==2.10.1 cyclonedx-bom==7.5.0
	touch $@

constraints: $(TOOLS)/.installed ## every package's version, those of constraints.txt kept where they can be; UPGRADE=--upgrade renews all
	$(COMPILE) --custom-compile-command "make constraints" $(UPGRADE) pyproject.toml -o constraints.txt

test-lowest: $(TOOLS)/.installed ## the tests with the lowest versions that pyproject.toml allows
	$(PYTHON) -m venv --clear $(VENV)-lowest
	$(UV) pip install --quiet --python $(VENV)-lowest --resolution lowest-direct -e '.[dev]'
	NUMBA_CACHE_DIR=$(CURDIR)/$(VENV)-lowest/numba $(VENV)-lowest/bin/python -m pytest -n auto

audit: $(VENV)/.installed $(TOOLS)/.installed ## a bill of materials (CycloneDX), and known vulnerabilities, which asks PyPI
	$(BIN)/pip check
	$(TOOLS)/bin/cyclonedx-py environment --pyproject pyproject.toml --output-reproducible -o sbom.json $(BIN)/python
	$(TOOLS)/bin/pip-audit --strict --skip-editable --path $$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')

clean:
	rm -rf $(VENV) $(TOOLS) $(VENV)-lowest site dist build sbom.json
