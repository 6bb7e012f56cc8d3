PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BASE := $(VENV)/.base
STAMP := $(VENV)/.installed

OLDEST ?= python3.11
NEWEST ?= python3.13
EXTRAS := dev,watch,control,app,sweeps

.PHONY: setup demo test test-kernels test-versions test-long test-cluster docs notebooks how_often_right paper bench lint clean

setup: $(STAMP)

$(BASE): pyproject.toml constraints.txt
	@echo "Installing belt_sim with JAX, MuJoCo, SciPy, pandas and matplotlib into $(VENV) (200 MB) ..."
	$(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e .
	@touch $(BASE)

$(STAMP): $(BASE)
	@echo "Installing what tests, documents and app need (1 GB) ..."
	@$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,watch,control,app,sweeps,docs]'
	@touch $(STAMP)

demo: $(BASE)
	@$(BIN)/belt-sim demo

test: setup  # two processes, a thread each: more would wait for each other
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --max-worker-restart 0

test-kernels: setup  # the linear algebra of two kinds of processors, on one with AVX-512
	for kernel in Haswell SkylakeX; do OPENBLAS_CORETYPE=$$kernel $(MAKE) test || exit 1; done

test-versions:  # both ends of the declared versions: the oldest and the newest Python and packages
	$(OLDEST) -m venv $(VENV)-oldest && $(VENV)-oldest/bin/pip install --quiet uv
	$(VENV)-oldest/bin/uv pip install --quiet --python $(VENV)-oldest/bin/python --resolution lowest-direct -e '.[$(EXTRAS)]'
	$(NEWEST) -m venv $(VENV)-newest && $(VENV)-newest/bin/pip install --quiet --upgrade -e '.[$(EXTRAS)]'
	for end in oldest newest; do $(VENV)-$$end/bin/python -m pytest -n 2 --max-worker-restart 0 || exit 1; done

test-long: setup
	$(BIN)/python -m pytest -m long -o faulthandler_timeout=0

docs: setup
	$(BIN)/python -m studies.site.words
	$(BIN)/python -m sphinx -W --keep-going -n -E -q -b html -d outputs/docs/.doctrees docs outputs/docs

notebooks: setup  # those of examples/, run and stored with their results
	$(BIN)/python -m studies.site.notebooks

how_often_right: setup
	$(BIN)/python -m studies.challenge count=0 publish=docs

paper: setup
	$(BIN)/python -m studies.open_question document=docs/data/open_question.md picture=docs/images/reading_windows.png
	$(BIN)/python -m studies.what_decides
	$(BIN)/python -m studies.paper document=docs/data/paper.md

test-cluster: setup  # as root on Debian: installs Slurm, starts it on this machine and stops it again
	tests/cluster/slurm.sh start
	$(BIN)/python -m pytest -m cluster; status=$$?; tests/cluster/slurm.sh stop; exit $$status

bench: setup  # base=CHECKOUT: an earlier version beside this one
	$(BIN)/python -m studies.bench picture=docs/images/bench.svg $(if $(base),base=$(base))

lint: setup
	$(BIN)/ruff check belt_sim studies tests
	$(BIN)/ruff format --check belt_sim studies tests
	$(BIN)/mypy

clean:
	rm -rf $(VENV) $(VENV)-oldest $(VENV)-newest outputs/*/
