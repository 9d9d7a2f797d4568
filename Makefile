# What can be done with flockreel. `make help` lists it; `make run` and `make test` are the two commands
# that a fresh Debian with Rust, a C compiler and make needs.

CARGO ?= cargo
DATA ?= data
BIND ?= 127.0.0.1:8080
RELEASE = target/release/flockreel
DEBUG = target/debug/flockreel

.DEFAULT_GOAL := help
.PHONY: help run test demo check fmt clippy unit scale-test race guards truth-test page-test contract-test soak arm-test docs deny bench accuracy ablation flocks papers vendor clean-data build

help: ## list the commands
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

run: build ## install what is missing, build, start the service and its page
	$(RELEASE) serve --bind $(BIND) --data $(DATA)

test: unit scale-test truth-test page-test contract-test ## install what the tests need and run them all
	@echo "all tests passed"

demo: build ## film -> library -> flock.mp4, without a server
	@mkdir -p target/demo
	$(RELEASE) sample -o target/demo/footage.mp4
	$(RELEASE) analyze target/demo/footage.mp4 -o target/demo/library
	$(RELEASE) flock target/demo/library -o flock.mp4 --count 20 --frames 400
	@echo "the flock is in flock.mp4"

check: fmt clippy unit scale-test truth-test page-test contract-test docs deny ## everything that CI checks
	@echo "all checks passed"

fmt: ## the formatting
	$(CARGO) fmt --check

clippy: target/vendor ## the lints, warnings as errors
	$(CARGO) clippy --locked --all-targets -- -D warnings

unit: target/vendor ## the tests in Rust
	@scripts/system-packages.sh test
	$(CARGO) test --locked

# Store, queue and API once more, as they are, on the other engine; and what needs several machines.
SCALE_TESTS = $(CARGO) test --locked --lib store:: && $(CARGO) test --locked --lib -- --ignored store:: && \
	$(CARGO) test --locked --test it -- jobs:: api:: && $(CARGO) test --locked --test it -- --ignored scale::
scale-test: target/vendor ## the service on a PostgreSQL and an S3 store that are started for it, with workers that are killed
	@scripts/with-servers.sh sh -c '$(SCALE_TESTS)'

guards: target/vendor ## every guard of a promise taken out once: its test must fail (docs/GUARDS.md)
	@scripts/system-packages.sh test contract-test
	@scripts/venv.sh target/contract-venv tests/contract/requirements.txt
	python3 -B tests/guards/run.py --write
	scripts/with-servers.sh python3 -B tests/guards/run.py --write

race: target/vendor ## eight processes race for 2000 jobs, on SQLite and on PostgreSQL
	FLOCKREEL_RACE_JOBS=2000 $(CARGO) test --locked --test it -- --nocapture jobs::races
	FLOCKREEL_RACE_JOBS=2000 scripts/with-servers.sh $(CARGO) test --locked --test it -- --nocapture jobs::races

# The program that the tests built, here and below: `cargo build` would build the dependencies anew, without the tests' features.
truth-test: target/vendor ## a flock's ground truth, read by the field's own tools
	$(CARGO) test --locked --no-run
	@scripts/python-tests.sh truth $(DEBUG)

page-test: vendor ## the page in a browser, against a really started service
	$(CARGO) test --locked --no-run
	@scripts/python-tests.sh page $(DEBUG)

contract-test: target/vendor ## the API against its own description, by schemathesis
	$(CARGO) test --locked --no-run
	@scripts/python-tests.sh contract $(DEBUG)

soak: target/vendor ## two hundred kills while films are uploaded
	FLOCKREEL_KILLS=200 $(CARGO) test --locked --test it -- jobs::uploads

# Not part of `check`: an emulated processor takes half an hour. ARM_TESTS=analysis::distance runs the kernels' alone.
ARM = aarch64-unknown-linux-gnu
ARM_TESTS ?=
arm-test: target/vendor ## the tests of the library on an emulated ARM processor, with its own vector instructions
	@scripts/system-packages.sh arm-test
	@rustup target list --installed 2>/dev/null | grep -q $(ARM) || rustup target add $(ARM)
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu" \
	CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc PROPTEST_CASES=8 \
	$(CARGO) test --locked --lib --target $(ARM) --target-dir target/arm $(ARM_TESTS)

docs: target/vendor ## the documentation, warnings as errors
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --no-deps --document-private-items

deny: ## licences, bans and sources of the dependencies, offline
	@if $(CARGO) deny --version >/dev/null 2>&1; then \
		$(CARGO) deny --offline check bans licenses sources; \
	else \
		echo "cargo deny: SKIPPED, not installed (cargo install --locked cargo-deny)"; \
	fi

bench: build ## the speed of the program against ffmpeg, OpenCV and SciPy
	@test -x target/bench-venv/bin/python || python3 -m venv target/bench-venv
	@target/bench-venv/bin/python -c "import numpy, scipy, cv2, faiss, mesa, networkx" 2>/dev/null || target/bench-venv/bin/pip install -q numpy scipy opencv-python-headless faiss-cpu mesa networkx
	@scripts/system-packages.sh bench
	-python3 bench/service.py $(RELEASE)
	-target/bench-venv/bin/python bench/analyze.py $(RELEASE)
	python3 bench/run.py $(RELEASE)
	target/bench-venv/bin/python bench/distance.py
	python3 bench/transitions.py
	python3 bench/plan.py
	target/bench-venv/bin/python bench/boids.py
	@test -d target/demo/library || $(MAKE) --no-print-directory demo
	python3 bench/render.py target/demo/library $(RELEASE)
	target/bench-venv/bin/python bench/reproduce.py $(RELEASE) target/demo/library target/demo/footage.mp4

accuracy: build target/bench-venv/ready ## the poses against the truth: make accuracy GENERATOR=goldfish.py [FOOTAGE=folder] [AGAINST=program]
	target/bench-venv/bin/python bench/accuracy.py $(RELEASE) $(GENERATOR) $(if $(FOOTAGE),--footage $(FOOTAGE)) $(if $(AGAINST),--against $(AGAINST))

# The tools of bench/ that read films and pictures.
target/bench-venv/ready:
	@python3 -m venv target/bench-venv
	@target/bench-venv/bin/pip install -q numpy opencv-python-headless pillow
	@touch $@

ablation: target/vendor target/bench-venv/ready ## every rule of the measurement switched off once: make ablation GENERATOR=goldfish.py [FOOTAGE=folder]
	target/bench-venv/bin/python bench/ablation.py $(GENERATOR) $(if $(FOOTAGE),--footage $(FOOTAGE))

flocks: build target/bench-venv/ready ## whether flocks move as their animals do: make flocks GENERATOR=goldfish.py [FOOTAGE=folder]
	target/bench-venv/bin/python bench/flocks.py $(RELEASE) $(GENERATOR) $(if $(FOOTAGE),--footage $(FOOTAGE))

papers: build ## the papers as printed against ours, on films with truth: docs/PAPERS.md
	python3 bench/papers.py $(RELEASE)

vendor: ## the page's libraries, from web/package-lock.json
	@scripts/vendor.sh

clean-data: ## forget all footage, libraries and flocks
	rm -rf $(DATA)

build: vendor
	@scripts/system-packages.sh build run
	$(CARGO) build --release --locked

# The program embeds this folder; checks do not need what is in it.
target/vendor:
	@mkdir -p $@
