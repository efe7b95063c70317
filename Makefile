# A fresh machine needs Python 3.11 or newer, pip and make; everything else is fetched into .venv at pinned versions.
#   make test    the tests            make lint    style and types
#   make demo    track a recorded log and draw it, into demo/
#   make bench   speed against C, scipy and CVODES: bench.json and its figures; needs gcc, takes some minutes
#   make study   what the docs quote of studies: study.json; takes some minutes, real oil needs data (RAMSIGHT_DATA=folder)
#   make fuzz     damaged files, states and slots, hostile frames, killed writers: fuzz.json; takes a quarter to half an hour
#   make pins    renew the pinned versions
# Another interpreter: make test PYTHON=python3.13

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PINS := requirements/dev.txt
INSTALLED := $(VENV)/installed.stamp
PYTEST_ARGS ?= -n 2 --dist loadfile
TRACE := tests/traces/boom_441kN_40C

.PHONY: demo test lint bench study fuzz pins clean

$(INSTALLED): pyproject.toml $(PINS)
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "ramsight needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r $(PINS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

demo: $(INSTALLED)
	mkdir -p demo
	$(BIN)/ramsight track mining-loader $(TRACE).csv.gz --unit boom --start "100 mm" \
	  --truth $(TRACE)_truth.csv.gz --out demo/track.csv --figure demo/track.png

test: $(INSTALLED)
	$(BIN)/python -m pytest $(PYTEST_ARGS)

lint: $(INSTALLED)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

bench: $(INSTALLED)
	$(BIN)/python bench/run.py --out bench.json
	$(BIN)/python bench/exported.py --out bench.json
	$(BIN)/python bench/figures.py bench.json docs/images

study: $(INSTALLED)
	$(BIN)/python study/run.py --out study.json
	$(BIN)/python study/pages.py

fuzz: $(INSTALLED)
	$(BIN)/python fuzz/run.py --out fuzz.json
	$(BIN)/python fuzz/page.py

# What pip would install now for the package, its development tools and the backend that builds it, a line each.
PIN_REPORT := $(VENV)/pins.json
define WRITE_PINS
import json, pathlib, re
found = json.loads(pathlib.Path("$(PIN_REPORT)").read_text())["install"]
names = {re.sub(r"[-_.]+", "-", item["metadata"]["name"]).lower(): item["metadata"]["version"] for item in found}
names.pop("ramsight")
pathlib.Path("$(PINS)").write_text("".join(f"{name}=={names[name]}\n" for name in sorted(names)))
endef
export WRITE_PINS

pins:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --dry-run --ignore-installed \
	  --report $(PIN_REPORT) -e ".[dev]" hatchling editables
	$(BIN)/python -c "$$WRITE_PINS"

clean:
	rm -rf $(VENV) demo build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
