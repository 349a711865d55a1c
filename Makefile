# The two commands of the README are "make demo" and "make test"; "make help" lists the rest.
# Each makes the virtual environment .venv where there is none and installs into it what requirements.lock names.

PYTHON ?= $(shell for name in python3 python3.13 python3.12 python3.11; do \
	"$$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo "$$name" && break; done)
BIN := .venv/bin
READY := .venv/.rotordrop-ready
OUTPUT := output/demo
MACHINE := src/rotordrop/machine/examples/lp400.toml
RECORDS := src/rotordrop/examples/lp400

.PHONY: help demo test slow test-all arithmetic lint docs audit bench lock kernels wheel wheelhouse offline clean
.DEFAULT_GOAL := help

help: ## list the commands
	@sed -n 's/^\([a-z-]*\):.*## /make \1 - /p' $(firstword $(MAKEFILE_LIST))

demo: $(READY) ## estimate force and stress from a bundled (simulated) recording and write the report
	@mkdir -p $(OUTPUT)
	@echo "Estimating, for about 20 seconds; the first time after an installation it compiles for about a minute ..."
	@$(BIN)/rotordrop estimate $(MACHINE) $(RECORDS)/drop_060.h5 --tail $(RECORDS)/drop_060_tail.csv \
		--json $(OUTPUT)/estimate.json --report $(OUTPUT)/report.html
	@echo "The recording is simulated. The report is $(CURDIR)/$(OUTPUT)/report.html"

# One worker a core; each begins with a part of the list and takes over from another what that has not begun.
PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses 8 --dist worksteal

test: $(READY) ## run the tests
	@$(PYTEST) -m "not slow" $(TESTS)

slow: $(READY) ## run the tests that "make test" leaves out
	@$(PYTEST) -m slow $(TESTS)

test-all: test slow ## run all tests

NUMERIC := tests/unit/physics tests/unit/rotor tests/unit/simulate tests/validation
FITTED := tests/unit/track/test_filter_and_smoother.py tests/unit/track/test_propagation.py \
	tests/unit/replay/test_replay.py

# An old processor has another linear algebra and no fused multiply-add at once; tests/unit/simulate/test_result.py
# tries each of the two alone.
arithmetic: $(READY) ## run the numeric tests with the arithmetic of other processors
	@OPENBLAS_CORETYPE=Prescott GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2 \
		$(BIN)/python -m pytest -q -m "not slow" $(NUMERIC) $(FITTED)
	@OPENBLAS_CORETYPE=Haswell $(BIN)/python -m pytest -q -m "not slow" $(FITTED)

lint: $(READY) ## check style, types, layers and sizes
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-cache
	@$(BIN)/python tools/rooms.py

docs: $(READY) ## build the documentation and run its examples
	@echo "Computing every validation case, then building the pages and running their examples, for some minutes ..."
	@$(BIN)/python docs/generate_validation.py
	@NUMBA_DISABLE_JIT=1 $(BIN)/python -m sphinx -q -W --keep-going -d docs/_build/read -b html docs docs/_build/html
	@$(BIN)/python -m sphinx -q -W --keep-going -d docs/_build/read -b doctest docs docs/_build/doctest
	@echo "The documentation is $(CURDIR)/docs/_build/html/index.html"

audit: $(READY) ## look the locked versions up in a database of known vulnerabilities
	@$(BIN)/python tools/audit.py

bench: $(READY) ## measure the speed of a drop against naive numpy (some minutes)
	@$(BIN)/python benchmarks/speed.py --output benchmarks/results.json

lock: $(READY) ## renew requirements.lock from pyproject.toml
	@$(BIN)/python -m pip install --quiet uv
	@echo '# Versions and hashes of everything that "make demo" and "make test" install. Written by "make lock".' \
		> requirements.lock
	@$(BIN)/uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --upgrade --quiet \
		--generate-hashes --no-emit-index-url --no-annotate --no-header >> requirements.lock

kernels: $(READY)
	@echo "Compiling the kernels that the wheel carries (about three minutes) ..."
	@$(BIN)/python tools/kernels.py build/kernels

wheel: kernels ## build into the folder dist a wheel that carries its compiled kernels
	@ROTORDROP_KERNELS=build/kernels $(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps \
		--no-build-isolation -w dist .

wheelhouse: kernels ## collect into the folder wheelhouse what an installation without a network needs
	@rm -rf wheelhouse
	@$(BIN)/python -m pip download --quiet --disable-pip-version-check --only-binary :all: --require-hashes \
		-r requirements.lock -d wheelhouse
	@ROTORDROP_KERNELS=build/kernels $(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps \
		--no-build-isolation -w wheelhouse . ./bench
	@echo "Copy this folder with wheelhouse to a computer of the same kind and with the same Python; there: make offline"

offline: ## make .venv from the folder wheelhouse, without a network
	@test -n "$$(ls wheelhouse/rotordrop-*.whl 2>/dev/null)" || \
		{ echo "there is no folder wheelhouse here; make it with 'make wheelhouse' where there is a network" >&2; exit 1; }
	@"$(PYTHON)" -m venv .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-index --find-links wheelhouse \
		--require-hashes -r requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-index --no-deps \
		wheelhouse/rotordrop-*.whl wheelhouse/rotordrop_bench-*.whl
	@echo "Installed: .venv/bin/rotordrop"

clean: ## remove what was built, the virtual environment included
	rm -rf .venv wheelhouse output build dist docs/_build docs/generated

$(READY): requirements.lock pyproject.toml bench/pyproject.toml
	@if [ -z "$(PYTHON)" ]; then \
		echo "rotordrop needs Python 3.11 or newer, and the python3 found here is" \
			"$$(python3 -V 2>&1 || true). Install a newer one and call: make PYTHON=/path/to/python3" >&2; exit 1; fi
	@"$(PYTHON)" -c 'import sys; v = sys.version.split()[0]; sys.exit(sys.version_info < (3, 11) and \
		f"rotordrop needs Python 3.11 or newer, and $(PYTHON) is {v}. Call: make PYTHON=/path/to/python3")'
	@test -x $(BIN)/python || "$(PYTHON)" -m venv .venv || \
		{ rm -rf .venv; echo "$(PYTHON) cannot make a virtual environment;" \
			"on Debian and Ubuntu install the package python3-venv" >&2; exit 1; }
	@echo "Installing into .venv what requirements.lock names (once, about a minute and a half) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e . -e bench
	@touch $(READY)
