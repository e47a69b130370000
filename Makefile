# Every command of the project; `make help` lists them.
# Needed beforehand: Rust 1.90+, Python 3.10+ with venv, make and a C linker. The rest is installed by .ci/setup.

PY := .venv/bin/python
CARGO_TEST := cargo test --release --locked --workspace --exclude python
# In CI a missing Vulkan device fails the tests that need one; elsewhere they skip.
ifdef CI
export BUMPWGPU_REQUIRE_GPU := 1
endif

.PHONY: help setup extension demo test test-rust test-python test-slow wheel bench lint clean
.DEFAULT_GOAL := help

help: ## list the commands
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{ printf "%-20s %s\n", $$1, $$2 }'

setup: ## check what is needed, install a Vulkan device when there is none, make .venv
	@.ci/setup

extension: setup ## compile the package into .venv (release build)
	@.venv/bin/maturin develop --release --quiet --extras plot,compare

demo: extension ## bake, render and compare real input; writes demo_output/
	@$(PY) examples/demo.py --output demo_output

test: test-rust test-python ## every test but the slow ones, Rust and Python

test-rust: setup ## the Rust tests
	$(CARGO_TEST)

test-python: extension ## the Python tests but the slow ones
	$(PY) -m pytest -m "not slow"

test-slow: extension ## the slow tests, Rust and Python
	$(CARGO_TEST) -- --ignored
	$(PY) -m pytest -m slow

wheel: setup ## one abi3 wheel and a source distribution in dist/
	.venv/bin/maturin build --release --out dist
	.venv/bin/maturin sdist --out dist

bench: setup ## time and error of every search, side by side
	cargo bench --locked -p heightfield

lint: extension ## formatting, clippy, ruff, mypy, stubtest
	cargo fmt --all --check
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy
	$(PY) -m mypy.stubtest bumpwgpu

clean: ## remove what the build and the demo wrote
	rm -rf target dist demo_output python/bumpwgpu/*.so .pytest_cache .mypy_cache .ruff_cache .hypothesis
