# `make demo` and `make test` are all a fresh machine with Python >= 3.11 needs.
PYTHON ?= python3
# For pipefail: a failed installation must not count as one.
SHELL := bash
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/installed
OUT ?= demo-study

.PHONY: install demo test quick check docs gallery bench bench-loop hazards mutation golden matrix fuzz docs-pictures paper-figures example-data clean

install: $(STAMP)

# Some versions of Python bring an old setuptools into a new environment; nothing here uses it.
$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "rigidimeter needs Python 3.11 or newer; $(PYTHON) is older. Try: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@echo "installing: a new environment in $(VENV)"
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --upgrade --constraint constraints.txt pip
	@$(BIN)/python -m pip uninstall --quiet --yes setuptools
	@echo "installing: rigidimeter, its extras and what its tests need; each package is named as it is fetched"
	@set -o pipefail; $(BIN)/python -m pip install --progress-bar off --constraint constraints.txt --editable '.[all,dev]' | \
		sed -u -n -e 's/^Collecting \([^ ]*\).*/  \1/p' -e '/^Installing collected/s/:.*//p'
	@touch $(STAMP)

demo: install
	$(BIN)/rigidimeter demo --out $(OUT)

# Hundreds of processes are started, and without bytecode each would compile the package anew.
test: export PYTHONDONTWRITEBYTECODE =

test: install
	$(BIN)/python -m tests

# Under a minute: before each commit.
quick: install
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports > /dev/null || $(BIN)/lint-imports
	$(BIN)/python -m pytest -q -n 2 -m "not slow and not realtime" tests/unit/core tests/unit/model tests/unit/rig/guard \
		tests/unit/test_fronts.py tests/docs/test_documents.py tests/docs/test_generated.py tests/docs/test_plain_words.py

check: install
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The site, in build/site; a warning, a dead link or a misspelt word is an error.
docs: install
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[docs]'
	$(BIN)/codespell README.md docs examples src
	$(BIN)/sphinx-build --fail-on-warning --keep-going -q -b html docs build/site
	@echo "the site: build/site/index.html"

# The gallery anew, with the scripts that need more packages, Octave or R; prints the seconds of each script.
gallery: install
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[docs,gallery]'
	rm -rf docs/gallery build/gallery
	set -o pipefail; $(BIN)/sphinx-build --fail-on-warning --keep-going --no-color -b html \
		-D sphinx_gallery_conf.filename_pattern=/ docs build/gallery | sed -n 's|^ *- ../examples/gallery/||p'
	@echo "the gallery: build/gallery/gallery/index.html"

bench: install
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[all,dev,bench,gallery]'
	$(BIN)/python -m pytest -m slow
	$(BIN)/python -m benchmarks
	$(BIN)/python -m benchmarks.joint_impedance --packages --jobs 2
	$(BIN)/python -m benchmarks.verdicts days --studies 20

# Beside cyclictest, of Debian's rt-tests.
bench-loop: install
	$(BIN)/python -m benchmarks.loop --seconds 60 --runs 3

hazards: install
	$(BIN)/python -m tests.faults.measure

mutation: install
	$(BIN)/python -m tests.mutation --hand-made
	$(BIN)/python -m tests.mutation

# Look at the difference of tests/golden/answers.txt before you commit it.
golden: install
	$(BIN)/python -m tests.golden

# Also the output that the tutorials show; it needs Chromium. Look at them before you commit them.
docs-pictures: install
	$(BIN)/python -m tests.docs.drawings
	$(BIN)/python -m tests.docs.pictures

# From the recordings of `rm.data`; printed are the numbers in the text.
paper-figures: install
	$(BIN)/python -m tests.docs.paper_figures

# The recordings that `rm.data` returns.
example-data: install
	$(BIN)/python -m tests.example_data

# Each Python that is here, with the core, each extra and all; with the oldest packages also the golden answers. Some 15 min.
matrix: install
	$(BIN)/python -m tests.matrix

SEED ?= 1
CASES ?= 4000
fuzz: install
	$(BIN)/python -m tests.fuzz --cases $(CASES) --seed $(SEED)

clean:
	rm -rf $(VENV) build src/*.egg-info .pytest_cache .mypy_cache .ruff_cache
