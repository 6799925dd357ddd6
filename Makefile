# make demo       evaluates the small session in fixtures/ into ./demo-out (makes .venv first if need be)
# make test       the default tests;  make test-slow: the long ones;  make lint: ruff
# make docs:      the documents as a site, in build/site
# make test-browser: the report in a headless Chromium (apt install chromium)
# make test-lowest: the small session with the oldest versions that are allowed, and whether it comes to the same numbers
# make test-versions: the same with the newest ones, too
# PYTHON=python3.12 make demo   takes another Python (3.11 or newer)

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Not byte-compiling 570 MB of libraries saves half a minute; what is imported is compiled when it is.
PIP_INSTALL := $(BIN)/python -m pip install --quiet --quiet --no-compile --disable-pip-version-check -c constraints.txt
# As many workers as there are processors.
WORKERS ?= $(shell $(PYTHON) -c 'import os; print(os.cpu_count() or 1)')

# The newest Python for test-versions; the oldest versions take PYTHON.
NEWEST_PYTHON ?= $(PYTHON)
SETS := $(VENV)-lowest $(VENV)-newest

.PHONY: demo test test-slow test-browser test-lowest test-versions lint docs clean

demo: $(VENV)/ready
	@$(BIN)/whisker-bench evaluate fixtures/small-session --out demo-out --workers $(WORKERS); code=$$?; \
	if [ $$code -gt 1 ]; then exit $$code; fi; \
	echo; echo "Open $(CURDIR)/demo-out/report.html; figures and tables are beside it."

test: $(VENV)/ready-for-tests
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile

test-slow: $(VENV)/ready-for-tests
	$(BIN)/python -m pytest -q -m slow

test-browser: $(VENV)/ready-for-tests
	$(BIN)/python -m pytest -q -m browser

test-lowest: $(VENV)/ready $(VENV)-lowest/ready
	@rm -rf versions-out
	@$(BIN)/python tests/studies/accuracy/versions.py versions-out $(BIN)/python $(VENV)-lowest/bin/python

test-versions: $(VENV)/ready $(SETS:=/ready)
	@rm -rf versions-out
	@$(BIN)/python tests/studies/accuracy/versions.py versions-out $(BIN)/python $(SETS:=/bin/python)

lint: $(VENV)/ready-for-tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

docs: $(VENV)/ready-for-docs
	$(BIN)/python docs/formats.py
	$(BIN)/python docs/thresholds.py > docs/thresholds.md
	$(BIN)/mkdocs build --strict

clean:
	rm -rf $(VENV) $(SETS) demo-out versions-out build/site

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	|| { echo "Python 3.11 or newer is needed; $(PYTHON) is $$($(PYTHON) -V 2>&1). Try PYTHON=python3.12 make"; exit 2; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	|| { echo "Python's venv module is not complete. On Debian and Ubuntu: sudo apt install python3-venv"; exit 2; }
	@$(PYTHON) -m venv $(VENV)

$(VENV)/ready: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing about 570 MB into $(VENV); this takes a minute or two."
	@$(PIP_INSTALL) -e .
	@touch $@

$(VENV)/ready-for-tests: $(VENV)/ready
	@echo "Installing what the tests need into $(VENV)."
	@$(PIP_INSTALL) -e '.[test]'
	@touch $@

# OpenCV's wheel asks for NumPy 2 and runs with 1.26, so it is installed without what it asks for.
$(VENV)-lowest/ready: pyproject.toml constraints-lowest.txt
	@$(PYTHON) -m venv $(VENV)-lowest
	@$(VENV)-lowest/bin/python -m pip install -qq --no-compile --only-binary :all: $$(grep -v opencv constraints-lowest.txt)
	@$(VENV)-lowest/bin/python -m pip install -qq --no-compile --only-binary :all: --no-deps $$(grep opencv constraints-lowest.txt)
	@touch $@

$(VENV)-newest/ready: pyproject.toml
	@$(NEWEST_PYTHON) -m venv $(VENV)-newest
	@$(VENV)-newest/bin/python -m pip install -qq --no-compile --upgrade --upgrade-strategy eager -e .
	@touch $@

$(VENV)/ready-for-docs: $(VENV)/ready
	@echo "Installing what the documents need into $(VENV)."
	@$(PIP_INSTALL) -e '.[docs]'
	@touch $@
