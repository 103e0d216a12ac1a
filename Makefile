# SPDX-License-Identifier: GPL-3.0-or-later
# The two commands that a newcomer needs: `make demo` and `make test`. Both prepare .venv by themselves.

VENV ?= .venv
PY := $(VENV)/bin/python
READY := $(VENV)/.ready
READY_BENCH := $(VENV)/.ready-bench
PIP_INSTALL := $(PY) -m pip install --disable-pip-version-check --quiet

.PHONY: help demo test lint bench papers package gui pictures clean

help:
	@echo "make demo     the LOD levels of the paper's cow, a table and a picture, in out/demo/"
	@echo "make test     the whole test suite"
	@echo "make lint     ruff and mypy"
	@echo "make bench    ours against the other simplifiers"
	@echo "make papers   the papers' tables and figures again, in out/papers/ (MODELS=DIR: of more meshes)"
	@echo "make package  the add-on's zip for Blender, in dist/"
	@echo "              WHEELS=1: one zip a platform that carries pymeshlab, for Measure's second opinion"
	@echo "make gui      the add-on in a real window, by simulated mouse and keys (BLENDER=PATH: in that Blender)"
	@echo "make pictures the pictures of README and docs, but for those of the window, which make gui takes"
	@echo "make clean    remove everything that these make"

demo: $(READY)
	$(PY) -m demo

test: $(READY)
	$(PY) -m pytest -n 2 --dist loadfile

lint: $(READY)
	$(PY) -m ruff check .
	$(PY) -m mypy

bench: $(READY_BENCH)
	$(PY) -m benchmarks
	$(PY) -m benchmarks --ablation --ratios 0.05 --repeat 1 --minutes 15
	$(PY) -m benchmarks.viewer

papers: $(READY)
	$(PY) -m evidence $(if $(MODELS),--models "$(MODELS)")

package: $(READY)
	$(PY) scripts/build_package.py dist $(if $(WHEELS),--wheels)

gui: package
	BLENDER="$(BLENDER)" scripts/gui_blender.sh run out/gui "$$(ls -t dist/eso_lod-*.zip | head -1)" tests_gui scenes.py
	for picture in docs/images/window/*.png; do cp "out/gui/pictures/$${picture##*/}" docs/images/window/ || exit; done

pictures: $(READY)
	$(PY) scripts/make_pictures.py docs/images

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
