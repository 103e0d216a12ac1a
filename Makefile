# SPDX-License-Identifier: GPL-3.0-or-later
# The two commands that a newcomer needs: `make demo` and `make test`. Both prepare .venv by themselves.

VENV ?= .venv
PY := $(VENV)/bin/python
READY := $(VENV)/.ready
READY_BENCH := $(VENV)/.ready-bench
PIP_INSTALL := $(PY) -m pip install --disable-pip-version-check --quiet

.PHONY: help demo test lint bench papers package clean

help:
	@echo "make demo     the LOD levels of the paper's cow, a table and a picture, in out/demo/"
	@echo "make test     the whole test suite"
	@echo "make lint     ruff and mypy"
	@echo "make bench    ours against the other simplifiers"
	@echo "make papers   the papers' tables and figures again, in out/papers/ (MODELS=DIR: of more meshes)"
	@echo "make package  the add-on's zip for Blender, in dist/"
	@echo "make clean    remove everything that these make"

demo: $(READY)
	$(PY) -m demo

test: $(READY)
	$(PY) -m pytest

lint: $(READY)
	$(PY) -m ruff check .
	$(PY) -m mypy

bench: $(READY_BENCH)
	$(PY) -m benchmarks

papers: $(READY)
	$(PY) -m evidence $(if $(MODELS),--models "$(MODELS)")

package: $(READY)
	$(PY) scripts/build_package.py dist

$(READY): pyproject.toml scripts/find_python.sh scripts/check_blender.py
	@python=$$(sh scripts/find_python.sh) && { [ -x $(PY) ] || "$$python" -m venv $(VENV); }
	$(PIP_INSTALL) -e ".[dev]"
	@$(PY) scripts/check_blender.py
	@touch $@

$(READY_BENCH): $(READY)
	$(PIP_INSTALL) -e ".[bench]"
	@touch $@

clean:
	rm -rf $(VENV) out dist build *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
