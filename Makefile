# Every target installs what it needs.  Begin with `make sweeps` and `make test`.
DATA  ?= synthetic
SCALE ?= full
ARGS  ?=
LAUNCH ?= local
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV   := .venv
RUN    := $(VENV)/bin/python -m pipeline
LIGHT_READY := $(VENV)/.ready-light
READY  := $(VENV)/.ready
DEV    := $(VENV)/.ready-dev
CLUSTER := $(VENV)/.ready-cluster
VIDEO  := $(VENV)/.ready-video
# pip installs the files of the lock files alone.  Packages without a wheel are built with their setuptools.
PIP    := $(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --no-build-isolation
# Small figures that call every compiled loop.  `make install` runs them in the background to fill the cache of numba.
LOOPS  := park2011_fig3c,park2011_fig4,mozerov2006_fig4,mozerov2006_tracking
FIGURES := $(notdir $(basename $(wildcard conf/experiment/*.yaml walk3d/conf/experiment/*.yaml)))
# LAUNCH=slurm|pbs|lsf|sge|oar|htcondor|moab|dask makes the figures by the workers of a cluster.
AS_JOBS := $(if $(filter-out local,$(LAUNCH)),launch=$(LAUNCH))
# One BLAS thread: many small solves are several times slower with more.
export OPENBLAS_NUM_THREADS ?= 1
export OMP_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1
# Cached byte code: without it every process of a sweep or test would parse all sources again.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: light video help install sweeps smoke data run reconstruct model inspect view status report tutorial equations claims sensitivity readme docs article check format test test-cluster cluster mutants bench golden digits golden-kernels archive verify clean pointlight $(FIGURES)

##@ Begin
help: ## print this list
	@awk -F ':.*## ' '/^##@ / {print "\n" substr($$0, 5)} /^[a-z-]+:.*## / {printf "  make %-14s %s\n", $$1, $$2}' Makefile
	@echo; echo "  one figure:   make FIGURE [DATA=synthetic|optical|cmu|hdm05] [SCALE=full|smoke], where FIGURE is"
	@echo "                $(FIGURES)" | fold -s -w 90 | sed '2,$$s/^/                /'
	@echo "  everything else: make run ARGS=--help"

install: $(READY) ## set up .venv for the figures, from requirements.lock
$(READY): requirements.lock $(LIGHT_READY)
	@echo "installing the packages of the figures from requirements.lock (once; the rerun viewer is large)"
	@$(PIP) -r requirements.lock
	@touch $(READY)
	@nohup $(RUN) figures experiment=$(LOOPS) scale=smoke figure.picture=false figure.recording=false workers=1 \
		results=$(VENV)/loops > $(VENV)/loops.log 2>&1 < /dev/null &

light: $(LIGHT_READY) ## set up .venv for keypoints, inspect and pointlight alone
$(LIGHT_READY): requirements-light.lock
	@test -n "$(PYTHON)" || { echo "no Python of version 3.11 or newer was found; name one: make $(MAKECMDGOALS) PYTHON=/path/to/python3" >&2; exit 1; }
	@echo "setting up $(VENV) from requirements-light.lock (once)"
	@test -x $(VENV)/bin/python || $(PYTHON) -m venv $(VENV)
	@$(PIP) -r requirements-light.lock
	@touch $(LIGHT_READY)

# All lock files together: every requirement of a tool needs its version and hash.
$(DEV): requirements-dev.lock $(CLUSTER)
	@echo "adding the tools of tests, checks and benchmarks from requirements-dev.lock (once)"
	@$(PIP) -r requirements.lock -r requirements-cluster.lock -r requirements-dev.lock
	@touch $(DEV)

cluster: $(CLUSTER) ## add Dask and joblib, for LAUNCH=slurm|pbs|…|dask and Hydra's launcher
$(CLUSTER): requirements-cluster.lock $(READY)
	@echo "adding Dask and joblib from requirements-cluster.lock (once)"
	@$(PIP) -r requirements.lock -r requirements-cluster.lock
	@touch $(CLUSTER)

video: $(VIDEO) ## add OpenCV and LiteRT, for films
$(VIDEO): requirements-video.lock $(LIGHT_READY)
	@echo "adding OpenCV and LiteRT from requirements-video.lock (once)"
	@$(PIP) -r requirements-light.lock -r requirements-video.lock
	@touch $(VIDEO)

##@ Figures of the papers
sweeps: $(READY) $(if $(AS_JOBS),$(CLUSTER)) ## every figure at full scale; DATA=synthetic (default), optical, cmu, hdm05; LAUNCH=slurm|pbs|…|dask: on a cluster
	@$(RUN) figures data=$(DATA) scale=$(SCALE) $(AS_JOBS) $(ARGS)

smoke: $(READY) $(if $(AS_JOBS),$(CLUSTER)) ## every figure at small scale
	@$(RUN) figures data=$(DATA) scale=smoke $(AS_JOBS) $(ARGS)

$(FIGURES): $(READY) $(if $(AS_JOBS),$(CLUSTER))
	@$(RUN) figures experiment=$@ data=$(DATA) scale=$(SCALE) $(AS_JOBS) $(ARGS)

data: $(READY) ## download the recordings of data/sources.csv; MOCAP_MIRROR=dir: from a copy first
	@$(RUN) fetch $(ARGS)

run: $(READY) $(if $(findstring hydra/launcher,$(ARGS)),$(CLUSTER)) ## one run with overrides: make run ARGS="experiment=zhang2007_fig5 model.components=20"
	@$(RUN) $(ARGS)

##@ Your own recordings
inspect: $(LIGHT_READY) ## contents of your recordings: make inspect INPUT=folder|file
	@$(RUN) inspect "$(INPUT)" $(ARGS)

pointlight: $(LIGHT_READY) ## a walk as moving dots: make pointlight INPUT=walk.c3d|FOLDER|synthetic|author ARGS="inverted=true to=walker.svg"
	@$(RUN) pointlight "$(or $(INPUT),synthetic)" $(ARGS)

reconstruct: $(LIGHT_READY) $(if $(filter %.mp4 %.mov %.m4v %.avi %.mkv %.webm,$(INPUT)),$(VIDEO)) ## a 3D walk from a film or 2D keypoints: make reconstruct INPUT=walk.mp4; INPUT=walk.json ARGS="input.frame_rate_hz=30 output.path=out"
	@$(RUN) reconstruct input.path="$(INPUT)" $(ARGS)

model: $(READY) ## train the model of reconstruct, from DATA=many (default) or your own data
	@$(RUN) model data=$(if $(filter synthetic,$(DATA)),many,$(DATA)) $(ARGS)

##@ Results
view: $(READY) ## open a recording: make view FIGURE=zhang2007_fig5 [DATA=…]
	@$(RUN) view $(FIGURE) data=$(DATA) scale=$(SCALE)

equations: $(READY) ## every numbered equation of the papers: as printed, as used, its test
	@$(RUN) equations $(ARGS)

status: $(READY) ## state of each figure, without computing: current, stale (and why) or missing
	@$(RUN) status data=$(DATA) scale=$(SCALE) $(ARGS)

report: $(READY) ## write the page over all figures, results/DATA/SCALE/index.html
	@$(RUN) report data=$(DATA) scale=$(SCALE) $(ARGS)

claims: $(READY) ## the papers' claims with our numbers and verdicts; FIGURE=…: of one figure
	@$(RUN) claims $(FIGURE) data=$(DATA) scale=$(SCALE)

sensitivity: $(READY) ## verdicts under other readings of the papers; ARGS=walks: one group of readings
	@$(RUN) sensitivity data=$(DATA) scale=$(SCALE) $(ARGS)

tutorial: $(READY) ## run tutorial.py, into results/tutorial
	@$(VENV)/bin/python tutorial.py

readme: $(READY) ## fill the results in README.md and docs/ from results/published.csv; ARGS=data=synthetic: renew its rows and the pictures first
	@$(RUN) readme $(ARGS)

docs: $(DEV) ## build the documentation, results/docs/index.html
	@$(VENV)/bin/python -W error -m mkdocs build --quiet
	@echo "results/docs/index.html"

article: $(DEV) ## build the article, results/article/article.pdf, from results/published.csv
	@$(VENV)/bin/python docs/article/build.py results/article/article.pdf
	@echo "results/article/article.pdf"

##@ The project itself
check: $(DEV) docs ## run ruff, mypy and the build of the documentation
	@$(VENV)/bin/ruff check .
	@$(VENV)/bin/ruff format --check .
	@$(VENV)/bin/mypy pipeline walk3d gait_pipeline

format: $(DEV) ## format the sources
	@$(VENV)/bin/ruff check --fix .
	@$(VENV)/bin/ruff format .

test: $(DEV) ## run the tests; ALL=1: also the thorough ones; ARGS=tests/core: some
	@$(VENV)/bin/python -m pytest -n auto --dist loadfile --no-loadscope-reorder $(if $(ALL)$(ARGS),,-m "not thorough") $(ARGS)

test-cluster: $(DEV) ## test LAUNCH=slurm on a Slurm of two nodes on this machine (Debian: slurmctld slurmd slurm-client munge)
	@TEST_CLUSTER=1 $(VENV)/bin/python -m pytest -n 0 tests/cluster $(ARGS)

mutants: $(DEV) ## change operators, numbers and arguments in a copy of the tree: do tests notice? N=, SEED=; ARGS="only=core again"
	@$(VENV)/bin/python -m tests.mutants $(or $(SEED),1) $(or $(N),10) $(ARGS)

bench: $(DEV) ## measure run times relative to peers and naive loops
	@$(VENV)/bin/python -m tests.benchmarks $(ARGS)

golden: $(DEV) ## renew tests/golden from a smoke run; FIGURE=…: one figure (moved numbers need a line under "Scientific changes")
	@rm -rf results/golden && AVERAGE_WALKER=tests/fixtures/mm_made_up.mm $(RUN) figures $(if $(FIGURE),experiment=$(FIGURE)) data=synthetic scale=smoke results=results/golden
	@$(VENV)/bin/python -m tests.contents results/golden/synthetic/smoke $(or $(FIGURE),$(FIGURES)); rm -rf results/golden

digits: $(DEV) ## renew tests/golden/digits.csv under other kernels and SIMD levels; ARGS=FIGURE: some figures
	@$(VENV)/bin/python -m tests.golden_digits $(ARGS)

golden-kernels: $(DEV) ## compare golden tables of iterative figures under two BLAS kernels
	@$(VENV)/bin/python -m tests.golden_digits --check $(ARGS)

##@ Keep and cite
archive: $(READY) $(if $(LIGHT),$(if $(filter synthetic,$(DATA)),tutorial)) ## archive full-scale results; LIGHT=1: small, for the repository; FIGURE=…: one figure; NAME=…: a changed run
	@$(RUN) archive data=$(DATA) $(if $(LIGHT),light=1) $(if $(FIGURE),only=$(FIGURE)) $(if $(NAME),name=$(NAME) $(if $(RUN_FOLDER),run=$(RUN_FOLDER)))

verify: $(READY) ## verify an archive by its hashes: make verify ARCHIVE=results/archive/…; RERUN=1: by computing it again
	@$(RUN) verify $(if $(ARCHIVE),$(ARCHIVE),$(patsubst %/,%,$(wildcard results/archive/*/))) $(if $(RERUN),rerun=1) $(if $(FIGURE),only=$(FIGURE))

clean: ## remove the cache and scratch results; figures and archives stay
	@rm -rf results/cache results/scratch results/golden
