# One word for each thing a developer or a curious person does. `make` alone lists them.
PYTHON ?= python3
VENV   ?= .venv
ARGS   ?=
BIN    := $(VENV)/bin
# Tests, checks and the demo start hundreds of Python processes. Where the environment forbids
# bytecode, as images of containers like to, each of them would compile every module it imports:
# a server then takes 2.2 s of the processor to start, instead of 0.9 s.
unexport PYTHONDONTWRITEBYTECODE
# pip would compile every module of every package to bytecode; Python does it at a module's first
# import. By pip's rule a negative option is switched on by a false value.
PIP    := PIP_NO_COMPILE=0 $(BIN)/python -m pip install --quiet --disable-pip-version-check
# The releases that were tried; `make test-newest` takes the newest. What users install has open ranges.
PINNED ?= --constraint constraints.txt
NPM    := $(BIN)/python hatch_build.py    # npm, the system's or the one of a wheel

# Processes that run tests side by side; `auto` is one for each core.
JOBS   ?= auto
# Newer makes keep the output of each target together; macOS has 3.81.
SYNC   := $(if $(filter output-sync,$(.FEATURES)),--output-sync=target)

.PHONY: help demo test test-all test-newest lock night check static format lint types web page fresh-page protocol life reference compiled docs bench soak containers results clean
help:  ## list the commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-11s %s\n", $$1, $$2}' Makefile

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "cohaptic needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1)." \
	       "Name another: make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; }
	@echo "setting up $(VENV) (once)"
	@$(PYTHON) -m venv $(VENV) || { \
	  echo "the venv module is missing; on Debian: apt-get install python3-venv"; exit 1; }
	@touch $@

# As SOURCES of hatch_build.py, which builds the page while the package is installed.
PAGE   := $(shell find $(addprefix web/,src index.html package.json package-lock.json vite.config.ts) -type f)

# What the package needs is fetched, unpacked and imported once, for its bytecode, while the package
# is built, which takes as long. What the demo spends its time in is compiled meanwhile, if it is to
# run: as plain Python it takes three times as much of the processor. The rest is compiled at the next
# start, or at once for another object. COHAPTIC_COMPILE=0 leaves all of that out.
export NEEDED = import tomllib; \
  print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["dependencies"], sep="\n")
export IMPORTED = import cohaptic_tools.demo.demonstration, cohaptic_server.cli.serving, cohaptic_client.touching
COMPILED := [ "$$COHAPTIC_COMPILE" = 0 ] || $(BIN)/python -m compiling
ALL      := $(wildcard $(VENV)/.installed)$(findstring --body,$(ARGS))$(findstring --nonlinear,$(ARGS))
$(VENV)/.installed: $(VENV)/.made pyproject.toml constraints.txt $(PAGE)
	@$(BIN)/python -c "$$NEEDED" >$(VENV)/.needed
	@{ $(PIP) $(PINNED) -r $(VENV)/.needed && PYTHONPATH=shared:server:client $(BIN)/python -c "$$IMPORTED"; } & \
	  others=$$!; { $(if $(filter demo,$(MAKECMDGOALS)),$(COMPILED) --first,true); } & compiled=$$!; \
	  $(PIP) --no-deps -e . && wait $$others; failed=$$?; wait $$compiled || true; exit $$failed
	@touch $@

$(VENV)/.dev: $(VENV)/.made pyproject.toml constraints.txt
	@$(PIP) $(PINNED) -e ".[dev]"
	@touch $@ $(VENV)/.installed

$(VENV)/.cluster: $(VENV)/.dev
	@$(PIP) $(PINNED) -e ".[notebook-tests]"
	@[ "$$(uname)" != Linux ] || $(PIP) $(PINNED) -e ".[cluster,cluster-tests]"
	@touch $@

$(VENV)/.docs: $(VENV)/.made pyproject.toml constraints.txt
	@$(PIP) $(PINNED) -e ".[docs]"
	@touch $@ $(VENV)/.installed

demo: $(VENV)/.installed  ## two users on one balloon; ARGS="--duration 10 --delay-ms 250"
	@$(if $(ALL),$(COMPILED) || true)
	@$(BIN)/cohaptic demo $(ARGS)

# Where there is no compiler the tests run on plain Python, and those that compare the two are skipped.
test: fresh-page  ## the proof that it works, some minutes; ARGS="tests/client -x" for a part of it
	@$(BIN)/python -m compiling || [ "$$CI" != true ]
	@JOBS=$(JOBS) $(BIN)/python tools/suite.py test $(ARGS)

test-all: fresh-page $(VENV)/.cluster  ## all tests, live ones at the end; has to pass before an issue is closed
	@$(BIN)/python -m compiling || [ "$$CI" != true ]
	@# Live tests leave half of two cores idle, and pyright takes the time that nobody else wants.
	@nice -n 19 $(BIN)/pyright >$(VENV)/.pyright 2>&1 & types=$$!; \
	JOBS=$(JOBS) $(BIN)/python tools/suite.py all $(ARGS); tested=$$?; \
	wait $$types && exit $$tested; cat $(VENV)/.pyright; echo "FAILED pyright, see above"; exit 1

night: fresh-page  ## what takes hours: long tests, new examples for every law, soak, fuzz
	@$(BIN)/python tools/suite.py night $(ARGS)

test-newest:  ## make test with the newest releases of everything that cohaptic needs
	@rm -f .venv-newest/.dev
	@$(MAKE) --no-print-directory test PINNED="--upgrade --upgrade-strategy eager" VENV=.venv-newest

lock: $(VENV)/.made  ## write constraints.txt anew, for all systems and Pythons
	@$(PIP) uv
	@$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --all-extras --upgrade \
	  --no-header --no-annotate pyproject.toml --output-file constraints.txt

check:  ## has to be green before a commit
	@$(MAKE) --no-print-directory static
	@$(MAKE) --no-print-directory test

static: $(VENV)/.dev
	@$(MAKE) --no-print-directory -j2 $(SYNC) --keep-going lint types web

format: $(VENV)/.dev  ## let ruff arrange the code
	@$(BIN)/ruff format . && $(BIN)/ruff check --fix .

lint: $(VENV)/.dev  ## format, lint, import contracts
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/lint-imports

types: $(VENV)/.dev  ## mypy, strict; pyright, strict too, is part of test-all
	@# Status 2 is a crash of mypy itself, seen once on a cold cache; 1 are findings.
	@$(BIN)/mypy || { [ $$? = 2 ] && $(BIN)/mypy --show-traceback; }

web: $(VENV)/.dev  ## the page in TypeScript: types, lint, tests
	@$(NPM) run --silent types
	@$(NPM) run --silent lint
	@$(NPM) run --silent test

# `make test` would try the page of yesterday's sources.
fresh-page: $(VENV)/.dev
	@$(BIN)/python hatch_build.py

page: $(VENV)/.dev  ## build the page into the server's package
	@$(NPM) run --silent build

life: $(VENV)/.installed  ## write what is made from the chains and from a participant's life: tables, drawing, the page's rules.ts
	@$(BIN)/python tools/life_of_a_force.py
	@$(BIN)/python tools/life_of_a_participant.py

protocol: $(VENV)/.installed  ## write what is made from the table of frames: the page's layout.ts, tables of docs/protocol.md
	@$(BIN)/python tools/generate_protocol.py

reference: $(VENV)/.installed  ## write the tables of public names into docs/reference
	@$(BIN)/python tools/generate_reference.py

compiled: $(VENV)/.installed  ## compile what is slow as Python, where its source has changed
	@$(BIN)/python -m compiling

docs: $(VENV)/.docs  ## build the documentation into site/; a warning is an error
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "open site/index.html"

bench: $(VENV)/.dev  ## cost of the haptic period and of the server's tick; ARGS="start --runs 9" for another of benchmarks/
ifeq ($(ARGS),)
	@$(BIN)/python benchmarks/loop.py
	@$(BIN)/python benchmarks/tick.py
	@$(BIN)/python benchmarks/spectators.py
else
	@$(BIN)/python benchmarks/$(firstword $(ARGS)).py $(wordlist 2,$(words $(ARGS)),$(ARGS))
endif

soak: $(VENV)/.dev  ## three minutes of everything that happens to a server; ARGS="--minutes 30"
	@$(BIN)/python benchmarks/soak.py --minutes 3 $(ARGS)

# debootstrap makes files of root's; the wheel, and the page in it, are the user's.
SUDO   ?= $(if $(filter 0,$(shell id -u)),,sudo --preserve-env)
containers: $(VENV)/.installed  ## build the image and bring docker-compose.yml up with podman, on Debian; ARGS=--install
	@$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	@$(SUDO) $(BIN)/python -B tools/containers.py $(ARGS)

results: $(VENV)/.dev  ## make docs/results.md again, about half an hour
	@$(BIN)/python experiments/results.py

clean:  ## delete everything that was built
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .hypothesis dist site web/node_modules server/cohaptic_server/page shared/cohaptic/_compiled
