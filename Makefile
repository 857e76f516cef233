# `make demo` and `make test` each work alone on a fresh checkout.

PYTHON ?= python3
BIN := .venv/bin

# Compiled XLA programs are kept between runs of this checkout.
export JAX_COMPILATION_CACHE_DIR := $(CURDIR)/.cache/jax

.PHONY: demo test test-long docs format clean

demo: .venv/installed
	$(BIN)/jaxplan solve --seed 100000 --out runs/demo

test: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/pytest -n auto --dist loadfile

# What `make test` leaves out because each takes long.
test-long: .venv/installed
	$(BIN)/pytest -n auto --dist loadfile -m "long and not slow and not gpu"

docs: .venv/installed
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[docs]' -c constraints.txt
	$(BIN)/mkdocs build --strict

format: .venv/installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf .venv .cache

.venv/installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "jaxplan needs Python 3.11 or newer: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "Python's venv is missing: sudo apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[dev]' -c constraints.txt
	@touch $@
