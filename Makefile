# A fresh machine needs Python 3.11 or newer, pip and make; everything else is fetched into .venv at pinned versions.
#   make test    the tests, minutes   make lint    style, types, what bandit finds, spelling and prose
#   make test-slow  the other tests: every circuit, hostile frames, what the pages show, compilers with sanitizers
#   make demo    a recorded work day: the sensor finds its position and learns; leaves demo/demo.png
#   make paper   the study of the paper again, with a verdict on each statement: build/paper (PAPER_ARGS: its options)
#   make film    a loader at work without position sensors: build/film/loader.html (FILM_ARGS: its options)
#   make bench   speed against C, scipy and CVODES: results/bench.json and its figures; the studio in Chromium: results/studio.json; needs gcc
#   make study   what the docs quote of studies: results/study.json; takes some minutes, real oil needs data (RAMSIGHT_DATA=folder)
#   make constants  what each number that decides something is worth: results/constants.json, results/constants_tested.json; takes about an hour
#   make fuzz    damaged files, states and slots, hostile frames, killed writers: results/fuzz.json; takes about an hour
#   make analyse  exported C by gcc's analyzer, and by clang-tidy and cppcheck where they are installed
#   make audit   known vulnerabilities of the pinned packages, where their database can be had
#   make mutants  small changes that break the code, each against its tests: results/mutants.json; takes some minutes
#   make docs    docs/, examples/ with what they draw, and the Python reference as a site, read offline: build/site/index.html
#   make site    the same, whether or not something has changed
#   make pins    renew the pinned versions
#   make package the wheel and the sdist, checked, installed without extras and tried on every Python that is here; minutes
#   make clean   away with everything that is made
# Another interpreter: make test PYTHON=python3.13

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PINS := requirements/dev.txt
INSTALLED := $(VENV)/installed.stamp
DOCS_PINS := requirements/docs.txt
DOCS_INSTALLED := $(VENV)/docs.stamp
SITE := build/site
PYTEST_ARGS ?= -n 2 --dist loadfile --no-loadscope-reorder
# One more worker than cores: who visits a page waits for it.
SLOW_ARGS ?= -n 3 --dist loadfile --no-loadscope-reorder
# Hundreds of processes load what the first one has compiled: a quarter of what a command's start takes.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help demo paper film test test-slow lint bench study constants fuzz analyse audit mutants docs site package pins clean

help:
	@sed -n 's/^#   make/make/p' $(firstword $(MAKEFILE_LIST))

$(INSTALLED): pyproject.toml $(PINS)
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "ramsight needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $(PINS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

demo: $(INSTALLED)
	mkdir -p demo
	$(BIN)/ramsight demo --out demo/demo.png

paper: $(INSTALLED)
	$(BIN)/python -m reproduction --out build/paper $(PAPER_ARGS)

film: $(INSTALLED)
	$(BIN)/python -m film --out build/film $(FILM_ARGS)

test: $(INSTALLED)
	$(BIN)/python -m pytest -m "not slow" $(PYTEST_ARGS)

test-slow: $(INSTALLED)
	$(BIN)/python -m pytest -m slow $(SLOW_ARGS)

lint: $(INSTALLED)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/bandit -q -r src -c pyproject.toml
	$(BIN)/mypy
	env MYPYPATH=src $(BIN)/mypy --strict examples/typed.py
	$(BIN)/codespell README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md docs examples film reproduction src
	$(BIN)/proselint check --config docs/proselint.json README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md docs/index.md docs/design.md docs/export.md docs/safety.md docs/validation.md docs/design docs/explanation docs/how-to docs/reference docs/tutorials

bench: $(INSTALLED)
	$(BIN)/python benchmarks/run.py --out results/bench.json
	$(BIN)/python benchmarks/starts.py --out results/bench.json
	$(BIN)/python benchmarks/exported.py --out results/bench.json
	$(BIN)/python benchmarks/cortex.py --out results/bench.json
	$(BIN)/python benchmarks/studies.py --out results/bench.json
	$(BIN)/python benchmarks/roofline.py --out results/bench.json
	$(BIN)/python benchmarks/growth.py --out results/bench.json
	$(BIN)/python benchmarks/peers.py --out results/bench.json
	$(BIN)/python benchmarks/figures.py results/bench.json docs/images
	$(BIN)/python benchmarks/limits_page.py
	$(BIN)/python benchmarks/studio.py --out results/studio.json

study: $(INSTALLED)
	$(BIN)/python evaluation/run.py --out results/study.json
	$(BIN)/python evaluation/bounds.py --out results/study.json
	$(BIN)/python evaluation/history_study.py --out results/history.json
	$(BIN)/python evaluation/pages.py
	$(BIN)/python evaluation/expected.py

fuzz: $(INSTALLED)
	$(BIN)/python fuzz/run.py --out results/fuzz.json
	$(BIN)/python fuzz/page.py

analyse: $(INSTALLED)
	RAMSIGHT_ANALYSE=1 $(BIN)/pytest -n 0 -m slow tests/test_export_analysis.py

# In an environment of its own: what looks through the pins is none of them.
AUDIT := $(VENV)/audit
audit:
	test -x $(AUDIT)/bin/pip-audit || $(PYTHON) -m venv $(AUDIT)
	$(AUDIT)/bin/python -m pip install --quiet --disable-pip-version-check pip-audit || true
	$(PYTHON) package/audit.py $(AUDIT)/bin/pip-audit $(PINS) $(DOCS_PINS)

constants: $(INSTALLED)
	$(BIN)/python evaluation/constants_varied.py --out results/constants.json --jobs 2
	$(BIN)/python evaluation/constants_varied.py --tests results/constants_tested.json --jobs 2
	$(BIN)/python evaluation/pages.py

mutants: $(INSTALLED)
	$(BIN)/python evaluation/mutants.py --out results/mutants.json

$(DOCS_INSTALLED): $(INSTALLED) $(DOCS_PINS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $(DOCS_PINS)
	touch $@

# Where a file of the project has changed every page again, so that every warning shows; else the site is as it would be.
docs: $(DOCS_INSTALLED)
	$(BIN)/python docs/built.py $(SITE) || $(MAKE) --no-print-directory site
	$(BIN)/python docs/check.py $(SITE)

site: $(DOCS_INSTALLED)
	rm -rf $(SITE) docs/gallery
	$(BIN)/python -m sphinx -q -W --keep-going -n -E -b html -d build/doctrees docs $(SITE)
	$(BIN)/ramsight export page --out $(SITE)/try.html
	$(BIN)/python docs/built.py $(SITE) --done

# What writes the bill of materials is in an environment of its own, as what audits the pins.
SBOM := $(VENV)/sbom
package: $(INSTALLED)
	rm -rf dist
	$(BIN)/python -m hatchling build -d dist
	test -x $(SBOM)/bin/cyclonedx-py || $(PYTHON) -m venv $(SBOM)
	$(SBOM)/bin/python -m pip install --quiet --disable-pip-version-check cyclonedx-bom || true
	$(BIN)/python package/check.py dist $(SBOM)/bin/cyclonedx-py

# What pip would install now, a line each: for the package, its development tools and the backend that builds it; and what the
# site needs beside that. Then the hashes of every file that an index has of them, for all platforms and Pythons; what adds
# them is in an environment of its own, and is none of the pins.
PIN_REPORT := $(VENV)/pins.json
define WRITE_PINS
import json, pathlib, re, sys
found = json.loads(pathlib.Path("$(PIN_REPORT)").read_text())["install"]
names = {re.sub(r"[-_.]+", "-", item["metadata"]["name"]).lower(): item["metadata"]["version"] for item in found}
there = {line.split("==")[0] for file in sys.argv[2:] for line in pathlib.Path(file).read_text().splitlines()}
lines = [f"{name}=={names[name]}\n" for name in sorted(names) if name not in {"ramsight", *there}]
pathlib.Path(sys.argv[1]).write_text("".join(lines))
endef
export WRITE_PINS
RESOLVE := $(BIN)/python -m pip install --quiet --disable-pip-version-check --dry-run --ignore-installed --report $(PIN_REPORT)

PINNING := $(VENV)/pinning
HASH := $(PINNING)/bin/uv pip compile --quiet --native-tls --no-deps --generate-hashes --no-annotate --no-header

pins:
	$(PYTHON) -m venv $(VENV)
	test -x $(PINNING)/bin/python || $(PYTHON) -m venv $(PINNING)
	$(PINNING)/bin/python -m pip install --quiet --disable-pip-version-check uv
	$(RESOLVE) -e ".[dev]" hatchling editables
	$(BIN)/python -c "$$WRITE_PINS" $(PINS)
	$(RESOLVE) --constraint $(PINS) -e ".[docs]"
	$(BIN)/python -c "$$WRITE_PINS" $(DOCS_PINS) $(PINS)
	$(HASH) $(PINS) --output-file $(PINS)
	$(HASH) $(DOCS_PINS) --output-file $(DOCS_PINS)

clean:
	rm -rf $(VENV) demo build dist docs/gallery .pytest_cache .mypy_cache .ruff_cache .hypothesis
