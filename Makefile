# Every command of the project; `make help` lists them.
# Needed beforehand: Rust 1.90+, Python 3.10+ with venv, make and a C linker. .ci/setup and .ci/device do the rest.

PY := .venv/bin/python
# The whole workspace, so that features resolve as for the wheel and its dependencies compile once.
CARGO_TEST := cargo test --release --locked --workspace
# In CI a missing Vulkan device fails the tests that need one; elsewhere they skip.
ifdef CI
export BUMPWGPU_REQUIRE_GPU := 1
endif

# Where nobody is logged in, Mesa's device-selection layer prints errors about displays; devices are ranked without it.
ifndef XDG_RUNTIME_DIR
export NODEVICE_SELECT := 1
endif

.PHONY: help setup device extension demo test test-rust test-python test-slow wheel bench bench-peers lint clean
.DEFAULT_GOAL := help

help: ## list the commands
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{ printf "%-20s %s\n", $$1, $$2 }'

setup: ## check what is needed beforehand and prepare .venv
	@.ci/setup

device: ## install a software Vulkan device when none answers
	@.ci/device

extension: setup ## compile the package into .venv (release build)
	@echo "Compiling: some minutes the first time, seconds after that."
	@PIP_QUIET=1 .venv/bin/maturin develop --release --extras plot,compare

demo: setup device extension ## bake, render and compare real input; writes demo_output/
	@$(PY) examples/demo.py --output demo_output

# Without a device the tests that need one are skipped, which .ci/device has then given the reason for.
test: setup ## every test but the slow ones, Rust and Python; with its own set-up
	@.ci/device || [ -z "$$CI" ]
	@$(MAKE) --no-print-directory test-rust test-python

test-rust: setup ## the Rust tests
	$(CARGO_TEST)

test-python: extension ## the Python tests but the slow ones
	$(PY) -m pytest -m "not slow"

test-slow: extension ## the slow tests: a hundred million rays, the whole demo, the wheel out of the source distribution
	$(CARGO_TEST) -- --ignored --nocapture
	$(PY) -m pytest -m slow

wheel: setup ## one abi3 wheel and a source distribution in dist/
	.venv/bin/maturin build --release --out dist
	.venv/bin/maturin sdist --out dist

# criterion would refuse a baseline that lacks a search, which a new one always does: hence lenient.
bench: setup ## time, error and instructions of every search in one table; QUICK=1 SAVE=name BASELINE=name
	@cargo bench --locked -p compare --bench search --no-run
	@echo "About ten minutes, two with QUICK=1. criterion's own report goes to target/bench.log."
	@BENCH_QUICK=$(QUICK) cargo bench --locked -p compare --bench search -- --quiet \
	    $(if $(BASELINE),--baseline-lenient $(BASELINE),$(if $(SAVE),--save-baseline $(SAVE))) \
	    >target/bench.log 2>&1 || { tail -20 target/bench.log >&2; exit 1; }
	@sed -n '/^Searches: /,$$p' target/bench.log

bench-peers: extension ## the same work by other programs, each in an environment of its own; PEERS="embree ..."
	@$(PY) tests/peers/run.py $(PEERS)

lint: extension ## formatting, clippy, ruff, mypy, stubtest
	cargo fmt --all --check
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy
	$(PY) -m mypy.stubtest --mypy-config-file pyproject.toml bumpwgpu._bumpwgpu bumpwgpu.techniques

clean: ## remove what the build and the demo wrote
	rm -rf target dist demo_output python/bumpwgpu/*.so .pytest_cache .mypy_cache .ruff_cache .hypothesis
