# make test   everything: Rust, the wheel, Python without Blender, the add-on in every bpy that can be had
# make test-gui  the add-on by mouse and keys in windows of real Blenders (4.3, 5.2), which Debian as root can have; pictures: out/gui
# make wheel  this platform's wheel: addon/wheels/; make zip the extension with it: out/
# make zips   wheels and extensions for all platforms: out/release/; make wheels the wheels alone, make wheel PLATFORM=… one of them
# make emulated-tests PLATFORM=…  the tests of a wheel in out/release/ for another platform, under an emulator of it
# make demo   unwrap the demonstration meshes and compare with Smart UV Project: out/
# make settings  what README, type stub, documentation and add-on say of the settings, from the core's table
# make bench  times of the stages; make flamegraph where the time of one unwrap goes; make scaling time and memory against faces
# make quality  charts, stretch, seams, packing and CPU seconds over shuffled triangulations: for before and after a change
# make packing  what share of a square packers cover with the same islands: ours, xatlas's, sparrow, Blender's where they are installed
# make shapes  boxes, bottles, gears and other common shapes, their layouts and seams drawn to be looked at: out/shapes.png
# make contact-sheet  every model under a checker beside its layout, in one picture: out/contact_sheet.png
# make paper  the paper's figures and its comparison with Isomap, measured anew: out/paper/; make paper-page the same, and
#             brings the page in native/paper up to date, of the last commit
# Knobs: PYTHON (3.11 or later), CARGO, MESH=file for the demo and the flame graph (.obj), BLENDER=/path/to/blender for a
# real one instead of bpy, MODELS="a.obj b.obj" for the paper's figure 3 and its table, for the scaling and the quality (.ply,
# .ply.gz, too), for the packing, the shapes and the contact sheet, COMPARE=smart for a third picture a model there, SHUFFLES=4 for the quality,
# PACKERS="ours xatlas" and SECONDS=60 (of sparrow, a set) for the packing, SUITES="trixie sid" for the windows and ALLOW_NONE=1 where
# having none is no error.

PYTHON ?= python3
CARGO ?= cargo
VENV := .venv-py
BIN := $(VENV)/bin
WHEELS := addon/wheels
RELEASE := out/release
CRATES := native/ble_unwrap_core native/ble_unwrap_native
# What the wheel is made of.
NATIVE := Cargo.toml Cargo.lock .ci/build_wheel .ci/platforms.py .ci/third_party_licenses $(shell find $(CRATES) -name '*.rs' -o -name '*.toml' -o -name '*.py' -o -name '*.pyi' -o -name settings.txt 2>/dev/null)

.PHONY: test test-rust test-python test-blender test-gui settings bench flamegraph scaling quality packing shapes contact-sheet lint format venv wheel zip wheels zips \
	emulated-tests demo paper paper-page clean

test: test-rust lint test-python test-blender

test-rust:
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc --workspace --no-deps --locked --document-private-items
	$(CARGO) test --locked

settings:
	$(CARGO) run --quiet --locked -p ble_unwrap_core --example settings_table > addon/settings.json.partial
	mv addon/settings.json.partial addon/settings.json
	$(PYTHON) .ci/settings_pages

# Figures and what they mean: native/ble_unwrap_core/benches/README.md. BENCH=unwrap/sculpt/972 runs one, BENCH=pack one stage.
bench:
	$(CARGO) bench --locked -p ble_unwrap_core --bench main -- $(BENCH)

# Needs no perf and no rights: the process samples itself.
flamegraph:
	$(CARGO) run --release --locked -p ble_unwrap_core --example flamegraph -- out/flamegraph.svg $(MESH)

scaling: $(VENV)/.wheel $(VENV)/.scaling
	$(BIN)/python native/evaluation/scaling $(MODELS)

quality: $(VENV)/.wheel
	$(BIN)/python native/evaluation/quality $(MODELS) $(if $(SHUFFLES),--shuffles $(SHUFFLES))

packing: $(VENV)/.wheel $(VENV)/.packing
	$(BIN)/python native/evaluation/packing $(MODELS) $(if $(PACKERS),--packers $(PACKERS)) $(if $(SECONDS),--seconds $(SECONDS))

shapes: $(VENV)/.wheel
	$(BIN)/python native/evaluation/shapes $(MODELS)

contact-sheet: zip
	.ci/blender_libraries
	$(BIN)/python .ci/contact_sheet $(MODELS) $(if $(COMPARE),--compare $(COMPARE))

test-python: $(VENV)/.wheel
	$(BIN)/python -m pytest tests --ignore=tests/blender

test-blender: zip
	.ci/blender_libraries
	$(BIN)/python .ci/test_blender

# Not a part of `make test`, which needs no root: .ci/run does both.
test-gui: zip
	.ci/debootstrap
	$(BIN)/python tests/gui/run.py $(if $(SUITES),--suite $(SUITES)) $(if $(ALLOW_NONE),--allow-none)

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: $(VENV)/.ready
	$(CARGO) fmt --all
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

venv: $(VENV)/.ready

# The tests install the wheel that lies in the add-on's folder; those of a release lie apart.
ifdef PLATFORM
wheel: $(VENV)/.ready
	$(BIN)/python .ci/build_wheel $(RELEASE) $(PLATFORM)
else
wheel: $(WHEELS)/.built
endif

zip: $(WHEELS)/.built
	$(BIN)/python .ci/build_extension out $(WHEELS)/*.whl

wheels: $(VENV)/.ready
	$(BIN)/python .ci/build_wheel $(RELEASE) all

zips: wheels
	$(BIN)/python .ci/build_extension $(RELEASE) $(RELEASE)/*.whl

emulated-tests: $(VENV)/.ready
	PATH="$(CURDIR)/$(BIN):$$PATH" .ci/emulated_tests $(PLATFORM) $(RELEASE)

demo: zip
	.ci/blender_libraries
	$(BIN)/python .ci/demo $(MESH)

paper: $(VENV)/.wheel $(VENV)/.paper
	.ci/blender_libraries
	$(BIN)/python .ci/paper $(MODELS)

paper-page: $(VENV)/.wheel $(VENV)/.paper
	.ci/blender_libraries
	$(BIN)/python .ci/paper --publish

clean:
	rm -rf target out .cache $(VENV) $(WHEELS)/*.whl $(WHEELS)/.built

$(VENV)/.ready: .ci/requirements.txt
	PYTHON="$(PYTHON)" .ci/make_venv $(VENV) -r .ci/requirements.txt
	touch $@

$(VENV)/.paper: native/paper/requirements.txt $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check -r native/paper/requirements.txt
	touch $@

$(VENV)/.scaling: native/evaluation/scaling/requirements.txt $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check -r native/evaluation/scaling/requirements.txt
	touch $@

$(VENV)/.packing: native/evaluation/packing/requirements.txt $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check -r native/evaluation/packing/requirements.txt
	touch $@

$(WHEELS)/.built: $(NATIVE) $(VENV)/.ready
	$(BIN)/python .ci/build_wheel $(WHEELS)
	touch $@

$(VENV)/.wheel: $(WHEELS)/.built
	$(BIN)/pip install --quiet --force-reinstall --no-deps --no-index $(WHEELS)/*.whl
	touch $@
