# Commands of flockreel; `make help` lists them. On a fresh Debian with Rust, a C compiler and make,
# `make run` and `make test` install what they need.

CARGO ?= cargo
DATA ?= data
BIND ?= 127.0.0.1:8080
RELEASE = target/release/flockreel
DEBUG = target/debug/flockreel

.DEFAULT_GOAL := help
.PHONY: help run test demo check fmt clippy programs unit scale-test race guards truth-test readers page-types page-test contract-test stress-test fuzz soak kills arm-test docs deny supply bench measure accuracy flocks papers fish service hostile transitions swift page-bench screenshots count ablation vendor clean-data build

help: ## list the commands
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

run: build ## install missing packages, build, and start the service with its page
	$(RELEASE) serve --bind $(BIND) --data $(DATA)

TESTS = unit scale-test page-test contract-test stress-test truth-test
test: $(TESTS) ## install the packages that tests need, and run all tests
	@echo "all tests passed"

demo: build ## film -> library -> flock.mp4, without a server
	@mkdir -p target/demo
	$(RELEASE) sample -o target/demo/footage.mp4
	$(RELEASE) analyze target/demo/footage.mp4 -o target/demo/library
	$(RELEASE) flock target/demo/library -o flock.mp4 --count 20 --frames 400
	@echo "the flock is in flock.mp4"

# One compilation gives programs and lints: clippy-driver compiles as rustc does.
check: export RUSTC_WORKSPACE_WRAPPER = clippy-driver
check: export CLIPPY_ARGS = -D__CLIPPY_HACKERY__warnings
check: deny fmt programs docs page-types $(TESTS) ## run all checks of CI
	@echo "all checks passed"

fmt: ## check the formatting
	$(CARGO) fmt --all --check

clippy: target/vendor ## run the lints, with warnings as errors
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

# Programs and tests. `cargo build` would build the dependencies again, because it selects fewer features.
TIMED = @scripts/timed.sh $@
programs: vendor
	@scripts/system-packages.sh build run
	$(TIMED) $(CARGO) test --locked --workspace --all-targets --no-run

unit: programs ## run the Rust tests: make unit [TESTS_OF="-E 'test(boids)'"]
	@scripts/system-packages.sh test
	$(TIMED) scripts/nextest.sh $(TESTS_OF)

# Tests of store, queue and API on PostgreSQL and a bucket, and tests that need several machines.
scale-test: programs ## test the service on PostgreSQL and an S3 store, with workers that are killed
	@scripts/system-packages.sh test
	$(TIMED) scripts/with-servers.sh scripts/nextest.sh --profile scale --run-ignored all

guards: target/vendor ## disable each protection of a promise once: its test must fail
	@scripts/system-packages.sh test contract-test
	@scripts/venv.sh target/contract-venv tests/contract/requirements.txt
	python3 -B tests/guards/run.py
	scripts/with-servers.sh python3 -B tests/guards/run.py

race: target/vendor ## let eight processes race for 2000 jobs, on SQLite and on PostgreSQL
	FLOCKREEL_RACE_JOBS=2000 $(CARGO) test --locked --test it -- --nocapture jobs::races
	FLOCKREEL_RACE_JOBS=2000 scripts/with-servers.sh $(CARGO) test --locked --test it -- --nocapture jobs::races

truth-test: programs ## read the ground truth of flocks and data sets with pycocotools and TrackEval
	$(TIMED) scripts/python-tests.sh truth $(DEBUG)

readers: programs ## read keypoints and data sets with movement, sleap-io and the label check of ultralytics
	$(TIMED) scripts/python-tests.sh readers $(DEBUG)

page-types: programs ## check the types of the page's modules against the OpenAPI document
	$(TIMED) python3 -B scripts/page-types.py $(DEBUG)

page-test: programs ## test the page in a browser, against a running service
	$(TIMED) scripts/python-tests.sh page $(DEBUG)

contract-test: programs ## test the API against its OpenAPI document, with schemathesis
	$(TIMED) scripts/python-tests.sh contract $(DEBUG)

stress-test: programs ## lose the power, let steps fail, send too much: make stress-test [CASES=400]
	@scripts/system-packages.sh test contract-test
	$(TIMED) python3 -B tests/stress/power_loss.py $(DEBUG)
	$(TIMED) python3 -B tests/stress/time_jumps.py $(DEBUG)
	$(TIMED) python3 -B tests/stress/overload.py $(DEBUG)
	$(TIMED) python3 -B tests/stress/failure_steps.py $(DEBUG) $(if $(filter all,$(CASES)),,--cases $(or $(CASES),16))

MINUTES ?= 60
soak: build target/bench-venv/ready ## run the service with good and hostile clients for an hour: make soak [MINUTES=60]
	python3 -B tests/stress/soak.py $(RELEASE) --minutes $(MINUTES) --result bench/results/soak.json
	$(BENCH) bench/measurements.py

kills: target/vendor ## kill the service two hundred times on each engine; keep the disk full for ten minutes
	FLOCKREEL_KILLS=200 $(CARGO) test --locked --test it -- jobs::uploads jobs::kills
	FLOCKREEL_KILLS=200 scripts/with-servers.sh $(CARGO) test --locked --test it -- jobs::uploads jobs::kills
	FLOCKREEL_FULL_SECONDS=60 $(CARGO) test --locked --test it -- jobs::full_disk::every_request

fuzz: target/vendor ## run every fuzz target for FUZZ_SECONDS (60): make fuzz [TARGETS="plan poses"]
	CARGO="$(CARGO)" scripts/fuzz.sh $(TARGETS)

# Not part of `check`, because it takes half an hour. ARM_TESTS=analysis::distance selects the kernels only.
ARM = aarch64-unknown-linux-gnu
ARM_TESTS ?=
arm-test: target/vendor ## run the library's tests on an emulated ARM processor, with its vector instructions
	@scripts/system-packages.sh arm-test
	@rustup target list --installed 2>/dev/null | grep -q $(ARM) || rustup target add $(ARM)
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu" \
	CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc PROPTEST_CASES=8 \
	$(CARGO) test --locked --workspace --lib --target $(ARM) --target-dir target/arm $(ARM_TESTS)

docs: programs ## test the examples of the documentation, build it with warnings as errors, and compare the reference with the program
	$(TIMED) env RUSTDOC=scripts/rustdoc.sh $(CARGO) test --locked --workspace --doc
	$(TIMED) python3 -B scripts/reference.py $(DEBUG) --check

deny: ## check licences, bans and sources of the dependencies, offline
	$(TIMED) scripts/cargo-deny.sh licences

# Exit status 3: the check cannot be had here, as its script has said.
supply: deny target/vendor ## also look for known weaknesses, list dependencies in target/sbom.json, run unsafe code under Miri
	@CARGO="$(CARGO)" scripts/cargo-deny.sh advisories || [ $$? -eq 3 ]
	@python3 -B scripts/sbom.py target/sbom.json
	@scripts/miri.sh || [ $$? -eq 3 ]

# Python of the scripts in bench/, with the packages to read films and to write docs/measurements.md.
BENCH = target/bench-venv/bin/python
target/bench-venv/ready:
	@python3 -m venv target/bench-venv
	@$(BENCH) -m pip install -q numpy opencv-python-headless pillow
	@touch $@

bench: build target/bench-venv/ready ## measure the speed against ffmpeg, OpenCV and SciPy
	@$(BENCH) -c "import scipy, faiss, mesa, networkx" 2>/dev/null || $(BENCH) -m pip install -q scipy faiss-cpu mesa networkx
	@scripts/system-packages.sh bench
	-$(BENCH) bench/service.py $(RELEASE)
	-$(BENCH) bench/analyze.py $(RELEASE)
	$(BENCH) bench/run.py $(RELEASE)
	$(BENCH) bench/distance.py
	$(BENCH) bench/transitions.py
	$(BENCH) bench/plan.py
	$(BENCH) bench/boids.py
	@test -d target/demo/library || $(MAKE) --no-print-directory demo
	$(BENCH) bench/render.py target/demo/library $(RELEASE)
	$(BENCH) bench/reproduce.py $(RELEASE) target/demo/library target/demo/footage.mp4

# The figures of bench/results. Each of these targets also writes docs/measurements.md.
measure: accuracy flocks papers fish service hostile transitions page-bench ## write docs/measurements.md: make measure GENERATOR=goldfish.py FOOTAGE=folder
	$(BENCH) bench/measurements.py

accuracy: build target/bench-venv/ready ## compare poses with the truth: make accuracy GENERATOR=goldfish.py [FOOTAGE=folder] [AGAINST=program] [ONLY=shoal,plants-2]
	$(BENCH) bench/accuracy.py $(RELEASE) $(GENERATOR) $(if $(FOOTAGE),--footage $(FOOTAGE)) $(if $(AGAINST),--against $(AGAINST)) $(if $(ONLY),--only $(ONLY))

flocks: build target/bench-venv/ready ## compare flocks with the films of their animals: make flocks GENERATOR=goldfish.py [FOOTAGE=folder]
	$(BENCH) bench/flocks.py $(RELEASE) $(GENERATOR) $(if $(FOOTAGE),--footage $(FOOTAGE))

papers: build target/bench-venv/ready ## compare the papers' methods as printed with flockreel, on films with known truth
	$(BENCH) bench/papers.py $(RELEASE)

fish: build target/bench-venv/ready ## compare the virtual animal with the filmed one: make fish [FOOTAGE=folder]
	$(BENCH) bench/fish.py $(RELEASE) $(if $(FOOTAGE),--footage $(FOOTAGE))

service: build target/bench-venv/ready ## compare the speed of the service with cp and nginx
	@scripts/system-packages.sh bench
	$(BENCH) bench/service.py $(RELEASE) --write

hostile: build target/bench-venv/ready ## measure what one hostile token at full force costs another
	$(BENCH) bench/hostile.py $(RELEASE)

transitions: target/bench-venv/ready ## measure how the search for transitions grows with the film
	$(BENCH) bench/transitions.py --most 50000 --write

swift: build target/bench-venv/ready ## time the way from a film to its living flock against an older program: make swift OLD=program FILMS="a.mp4 b.mp4"
	$(BENCH) bench/swift.py $(RELEASE) $(OLD) $(FILMS) --write

page-bench: vendor build target/bench-venv/ready ## measure the page in Chromium
	@scripts/system-packages.sh page-test
	@scripts/venv.sh target/page-venv tests/page/requirements.txt
	target/page-venv/bin/python bench/page.py $(RELEASE)
	$(BENCH) bench/measurements.py

screenshots: vendor build ## make pictures of every place of the page and a recording, in target/screenshots
	@scripts/system-packages.sh page-test screenshots
	@scripts/venv.sh target/page-venv tests/page/requirements.txt
	target/page-venv/bin/python -B scripts/screenshots.py $(RELEASE) target/screenshots

count: ## count lines, constants and imports by module: make count [WRITE=1]
	@$(if $(WRITE),$(MAKE) --no-print-directory target/bench-venv/ready)
	@$(if $(WRITE),$(BENCH),python3) -B bench/count.py $(if $(WRITE),--write)

ablation: target/vendor target/bench-venv/ready ## switch off each rule of the measurement once: make ablation GENERATOR=goldfish.py [FOOTAGE=folder] [JOBS=1]
	$(BENCH) bench/ablation.py $(GENERATOR) $(if $(FOOTAGE),--footage $(FOOTAGE)) $(if $(JOBS),--jobs $(JOBS))

vendor: ## build the page's libraries from web/package-lock.json
	@scripts/vendor.sh

clean-data: ## delete the data folder with all footage, libraries and flocks
	rm -rf $(DATA)

build: vendor
	@scripts/system-packages.sh build run
	$(CARGO) build --release --locked

# The program embeds this folder. It may be empty for checks.
target/vendor:
	@mkdir -p $@
