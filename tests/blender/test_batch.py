"""The batch: a report at any moment, whatever ends the run; resuming by all that a result depends on; no file lost."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import addon_loader
import bpy
import pytest
from scenes import cube, grid, sphere

REPO = Path(__file__).resolve().parent.parent.parent


def read_report(path):
    return json.loads(Path(path).read_text(encoding="utf-8"))


@pytest.fixture
def batch(addon, tmp_path, monkeypatch, capsys):
    """Runs the batch in this process, in the test's own folder: exit code and all it printed."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        code = addon("batch").main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out + captured.err

    return run


# The report, as it goes ----------------------------------------------------------------------------------------------


@pytest.fixture
def started(tmp_path):
    """Starts unwrap.py in a process of its own and returns it running."""
    processes = []

    def start(*arguments):
        script = REPO / "blender_scripts" / "unwrap.py"
        if addon_loader.is_module():
            command = [sys.executable, script]
        else:
            command = [bpy.app.binary_path, "--background", "--factory-startup", "--python", script, "--"]
        with (tmp_path / "log.txt").open("ab") as log:
            process = subprocess.Popen([*map(str, command), *map(str, arguments)], cwd=tmp_path, stdout=log, stderr=log)
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.wait()


def wait_for_assets(path, count, process):
    """Waits until the report lists so many assets; it is valid each time that it is looked at."""
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        assert process.poll() is None, "it ended by itself: too little work for this test"
        if path.exists():
            report = read_report(path)
            assert report["state"] == "running"
            if len(report["assets"]) >= count:
                return
        time.sleep(0.01)
    raise AssertionError("the report did not grow")


def many(files, count=40):
    sphere(cells=24)
    first = files("ball_0.blend")
    names = [first.with_name(f"ball_{number}.blend") for number in range(count)]
    for name in names[1:]:
        shutil.copy(first, name)
    return names


@pytest.mark.skipif(os.name == "nt", reason="no such signals there")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT", "SIGKILL"])
def test_whatever_ends_a_batch_what_was_done_is_known(started, run_script, files, tmp_path, name):
    sources = many(files)
    arguments = [*sources, "-o", "out", "--report", "r.json"]
    process = started(*arguments)
    wait_for_assets(tmp_path / "r.json", 3, process)
    process.send_signal(getattr(signal, name))
    code = process.wait(timeout=60)
    log = (tmp_path / "log.txt").read_text()
    assert "Traceback" not in log
    report = read_report(tmp_path / "r.json")
    listed = {asset["out"] for asset in report["assets"] if asset["status"] == "ok"}
    written = {f"out/{path.name}" for path in (tmp_path / "out").glob("*.blend")}
    if name == "SIGKILL":
        assert code == -signal.SIGKILL and report["state"] == "running"
        journal = [json.loads(line)["out"] for line in (tmp_path / "r.json.journal").read_text().splitlines()]
        listed |= set(journal)
        assert len(written - listed) <= 1, "at most the one that was being written is not known"
    else:
        assert code == 5, log
        assert f"stopped by {name}" in log
        assert report["state"] == "interrupted" and report["stopped_by"] == name
        assert report["planned"] == len(sources) > report["summary"]["ok"] == len(report["assets"])
        assert written == listed and not (tmp_path / "r.json.journal").exists()
        assert not list((tmp_path / "out").glob(".*")), "no temporary files are left"
    assert 3 <= len(listed) < len(sources)
    done = run_script("unwrap.py", *arguments, "--resume")
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("done already") == len(listed)
    report = read_report(tmp_path / "r.json")
    assert report["state"] == "complete" and report["summary"]["ok"] == len(sources)
    assert not (tmp_path / "r.json.journal").exists() and not list(tmp_path.glob(".r.json*"))


@pytest.mark.skipif(os.name == "nt", reason="no such signals there")
def test_resumed_batch_that_is_stopped_forgets_nothing(addon, batch, files, tmp_path, monkeypatch):
    """What an earlier run did and the stopped one had not yet reached is known to the third."""
    sources = many(files, 4)
    arguments = [*sources, "-o", "out", "--report", "r.json", "--resume"]
    assert batch(*arguments)[0] == 0
    sources[0].touch()
    (tmp_path / "out" / sources[0].name).write_bytes(b"")  # so that the first is done anew
    process, before = addon("batch").process, signal.getsignal(signal.SIGTERM)

    def stopped(*given):
        os.kill(os.getpid(), signal.SIGTERM)
        return process(*given)

    monkeypatch.setattr(addon("batch"), "process", stopped)
    code, text = batch(*arguments)
    assert code == 5 and "stopped by SIGTERM, 0 of 4 files were done" in text
    assert signal.getsignal(signal.SIGTERM) in (before, signal.SIG_DFL)
    report = read_report(tmp_path / "r.json")
    assert len(report["assets"]) == 0 and len(report["earlier"]) == 4
    monkeypatch.setattr(addon("batch"), "process", process)
    code, text = batch(*arguments)
    assert code == 0 and text.count("done already") == 3
    assert read_report(tmp_path / "r.json")["earlier"] == []


@pytest.mark.skipif(os.name == "nt", reason="no such signals there")
def test_ignored_signals_stay_ignored(addon):
    """`nohup` and shells ignore signals for what they start; that is not undone."""
    signals = addon("batch.stop_signals")
    before, of_keyboard = signal.signal(signal.SIGHUP, signal.SIG_IGN), signal.getsignal(signal.SIGINT)
    try:
        with signals.StopRequest() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            stop.check()
            os.kill(os.getpid(), signal.SIGINT)
            with pytest.raises(signals.Stopped, match="SIGINT"):
                stop.check()
            assert signal.getsignal(signal.SIGINT) in (of_keyboard, signal.SIG_DFL), "a second one ends the process"
    finally:
        signal.signal(signal.SIGHUP, before)


def entry(number):
    return {"in": f"{number}.obj", "out": f"out/{number}.obj", "status": "ok", "text": "x" * 200}


def test_cost_of_the_report_grows_with_the_work(addon, tmp_path, monkeypatch):
    """10,000 assets of 20 ms each, on a clock that counts a microsecond for each line written: a twentieth at most."""
    reports = addon("batch.report")
    clock = [0.0]
    monkeypatch.setattr(reports.time, "monotonic", lambda: clock[0])
    lines = []

    def replaced(_path, parts):
        lines.append(sum(part.count("\n") for part in parts))
        clock[0] += 1e-6 * lines[-1]

    monkeypatch.setattr(reports, "_replace", replaced)
    report = reports.ReportFile(tmp_path / "r.json", {"schema": 2}, {})
    report.start()
    for number in range(10_000):
        clock[0] += 0.02
        report.add(entry(number))
    assert len(lines) > 100, "it is written as the run goes"
    assert 1e-6 * sum(lines) < 0.06 * clock[0]
    assert len((tmp_path / "r.json.journal").read_text().splitlines()) == 10_000


def test_journal_holds_what_the_report_lacks(addon, tmp_path):
    """Also where the process was killed while it wrote a line, or before there was any report."""
    reports = addon("batch.report")
    path = tmp_path / "r.json"
    report = reports.ReportFile(path, {"schema": 2}, {("a", "b"): {"in": "a", "out": "b", "status": "ok"}})
    report.start()
    report._due = float("inf")
    report.add(entry(1))
    report.add(entry(2))
    assert json.loads(path.read_text())["assets"] == []
    with (tmp_path / "r.json.journal").open("a") as journal:
        journal.write('{"in": "3.obj", "out": "ou')
    assert set(reports.earlier_assets(path)) == {("a", "b"), ("1.obj", "out/1.obj"), ("2.obj", "out/2.obj")}
    path.unlink()
    assert len(reports.earlier_assets(path)) == 2
    report.finish("complete")
    assert len(reports.earlier_assets(path)) == 3 and not (tmp_path / "r.json.journal").exists()


def test_report_that_cannot_be_written_is_said_before_any_work(batch, files, tmp_path):
    cube()
    files("a.obj")
    (tmp_path / "file").write_text("in the way")
    code, text = batch("a.obj", "-o", "out", "--report", "file/r.json")
    assert code == 1 and "cannot write the report file/r.json" in text
    assert not (tmp_path / "out").exists()


# Resuming ------------------------------------------------------------------------------------------------------------


def assert_done_anew(batch, arguments, change, *more):
    """A run, one that has nothing to do, and after a change one that does all again, and then nothing."""
    arguments = [*arguments, "-o", "out", "--report", "r.json", "--resume"]
    for expected in (False, True):
        code, text = batch(*arguments)
        assert code == 0 and ("done already" in text) is expected, text
    change()
    for expected in (False, True):
        code, text = batch(*arguments, *more)
        assert code == 0 and ("done already" in text) is expected, text


def nothing():
    pass


@pytest.mark.parametrize("more", [["--atlas", "object"], ["--compare"], ["--margin", "5"], ["--preset", "paper"]])
def test_other_settings_and_options_are_done_anew(batch, files, more):
    cube()
    assert_done_anew(batch, [files("a.obj")], nothing, *more)


@pytest.mark.parametrize("more", [["--threads", "1"], ["--quiet", "--threads", "2"]])
def test_what_changes_no_result_is_not(batch, files, more):
    cube()
    arguments = [files("a.obj"), "-o", "out", "--report", "r.json", "--resume"]
    assert batch(*arguments)[0] == 0
    written = Path("out/a.obj").stat().st_mtime_ns
    assert batch(*arguments, *more)[0] == 0
    assert Path("out/a.obj").stat().st_mtime_ns == written


def test_other_version_is_done_anew(addon, batch, files, monkeypatch):
    cube()
    assert_done_anew(batch, [files("a.obj")], lambda: monkeypatch.setattr(addon("engine"), "version", lambda: "9.9"))


DAMAGES = {
    "emptied": lambda path: path.write_bytes(b""),
    "one byte": lambda path: path.write_bytes(path.read_bytes()[:-1] + b"?"),
    "gone": lambda path: path.unlink(),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_damaged_output_is_made_anew(batch, files, tmp_path, kind, damage):
    cube()
    out = tmp_path / "out" / f"a.{kind}"
    assert_done_anew(batch, [files(f"a.{kind}")], lambda: DAMAGES[damage](out))
    assert out.stat().st_size > 1


def test_materials_beside_an_output_are_part_of_it(batch, files, tmp_path):
    cube().data.materials.append(bpy.data.materials.new("Red"))
    assert_done_anew(batch, [files("a.obj")], lambda: (tmp_path / "out/a.mtl").unlink())
    assert (tmp_path / "out/a.mtl").is_file()


def append(path, text):
    path.write_bytes(path.read_bytes() + text)


def test_buffer_of_a_gltf_is_an_input(batch, files, tmp_path):
    grid(4, bump=0.2)
    source = files("a.gltf")

    def change():
        data = bytearray((tmp_path / "a.bin").read_bytes())
        data[2] ^= 0x40  # a coordinate
        (tmp_path / "a.bin").write_bytes(data)

    assert_done_anew(batch, [source], change)
    assert set(read_report(tmp_path / "r.json")["assets"][0]["resume"]["read"]) == {"a.gltf", "a.bin"}


def test_materials_of_an_obj_are_an_input(batch, files, tmp_path):
    cube().data.materials.append(bpy.data.materials.new("Red"))
    assert_done_anew(batch, [files("a.obj")], lambda: append(tmp_path / "a.mtl", b"\n# changed\n"))


def test_file_that_was_missing_and_came_is_a_change(batch, files, tmp_path):
    cube().data.materials.append(bpy.data.materials.new("Red"))
    source = files("a.obj")
    materials = (tmp_path / "a.mtl").read_bytes()
    (tmp_path / "a.mtl").unlink()
    assert_done_anew(batch, [source], lambda: (tmp_path / "a.mtl").write_bytes(materials))


def saved_in_place(path):
    """Writes the scene by Blender alone, so that its relative paths lead from there."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def test_linked_library_is_an_input(batch, files, tmp_path):
    bpy.data.materials.new("Linked").use_fake_user = True
    library = files("library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(library), link=True, relative=False) as (_there, wanted):
        wanted.materials = ["Linked"]
    cube().data.materials.append(bpy.data.materials["Linked"])
    source = saved_in_place(tmp_path / "a.blend")

    def change():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.data.materials.new("Linked").use_fake_user = True
        bpy.data.materials.new("Another").use_fake_user = True
        files("library.blend")

    assert_done_anew(batch, [source], change)
    assert "library.blend" in read_report(tmp_path / "r.json")["assets"][0]["resume"]["read"]


def test_texture_is_an_input(batch, tmp_path):
    """Some formats carry it, so it counts for all."""
    picture = tmp_path / "picture.png"
    image = bpy.data.images.new("Picture", 8, 8)
    image.filepath_raw, image.file_format = str(picture), "PNG"
    image.save()
    image.source = "FILE"
    material = bpy.data.materials.new("Painted")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    cube().data.materials.append(material)
    assert_done_anew(batch, [saved_in_place(tmp_path / "a.blend")], lambda: append(picture, b"more"))


def test_report_of_another_make_resumes_nothing(batch, files, tmp_path):
    cube()
    arguments = [files("a.obj"), "-o", "out", "--report", "r.json", "--resume"]
    old = {"schema": 1, "params": {}, "assets": [{"in": str(arguments[0]), "out": "out/a.obj", "status": "ok"}]}
    for text in (json.dumps(old), "[]", "{", json.dumps({"assets": [3, None]}), "\x00"):
        (tmp_path / "r.json").write_text(text)
        code, said = batch(*arguments)
        assert code == 0 and "done already" not in said


# Where results go ----------------------------------------------------------------------------------------------------


def test_same_names_in_two_folders_keep_their_folders(batch, files, tmp_path):
    cube()
    for folder in ("in/a", "in/b/c"):
        (tmp_path / folder).mkdir(parents=True)
        shutil.copy(files("model.obj"), tmp_path / folder / "model.obj")
    shutil.copy(tmp_path / "model.obj", tmp_path / "in/a/other.obj")
    code, text = batch("in/a/model.obj", "in/b/c/model.obj", "in/a/other.obj", "-o", "out")
    assert code == 0, text
    written = sorted(path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.obj"))
    assert written == ["a/model.obj", "a/other.obj", "b/c/model.obj"]
    assert "their folders below" in text
    assert batch("in/a/model.obj", "in/a/other.obj", "-o", "flat")[0] == 0
    assert (tmp_path / "flat/model.obj").is_file() and (tmp_path / "flat/other.obj").is_file()


def stl_and_glb(files, tmp_path, folder):
    (tmp_path / folder).mkdir()
    cube()
    for name in ("model.stl", "model.glb"):
        shutil.move(files(name), tmp_path / folder / name)


def test_namesakes_of_other_formats_both_get_a_result(batch, files, tmp_path):
    stl_and_glb(files, tmp_path, "in")
    for order in (["in/model.stl", "in/model.glb"], ["in/model.glb", "in/model.stl"]):
        code, text = batch(*order, "-o", "out", "--report", "r.json")
        assert code == 0, text
        assert "out/model.glb is taken by in/model.glb: written to out/model.stl.glb" in text
        assert {path.name for path in (tmp_path / "out").iterdir()} == {"model.glb", "model.stl.glb"}
        assets = {asset["in"]: asset for asset in read_report(tmp_path / "r.json")["assets"]}
        assert assets["in/model.stl"]["out"] == "out/model.stl.glb"
        assert "is taken by" in assets["in/model.stl"]["warnings"][0]


def test_file_that_is_not_known_as_a_result_is_kept(batch, files, tmp_path):
    """In the input's folder and in any other; the report, --overwrite and -o FILE say that it may go."""
    stl_and_glb(files, tmp_path, "in")
    own = (tmp_path / "in/model.glb").read_bytes()
    (tmp_path / "out").mkdir()
    shutil.copy(tmp_path / "in/model.glb", tmp_path / "out/model.glb")
    for folder in ("in", "out"):
        code, text = batch("in/model.stl", "-o", folder)
        assert code == 1 and f"{folder}/model.glb exists and is not known as a result of model.stl" in text
        assert (tmp_path / folder / "model.glb").read_bytes() == own
        assert "--overwrite" in text
    assert batch("in/model.stl", "-o", "new", "--report", "r.json")[0] == 0
    assert batch("in/model.stl", "-o", "new")[0] == 1, "without the report it could be anybody's"
    assert batch("in/model.stl", "-o", "new", "--report", "r.json")[0] == 0
    assert batch("in/model.stl", "-o", "out", "--overwrite")[0] == 0
    assert (tmp_path / "out/model.glb").read_bytes() != own
    assert batch("in/model.stl", "-o", "in/model.glb")[0] == 0


def test_same_name_as_the_input_is_replaced(batch, files):
    cube()
    source = files("a.obj")
    for _ in range(2):
        assert batch(source, "-o", "out")[0] == 0


def test_materials_of_another_are_kept(batch, files, tmp_path):
    cube()
    source = files("model.stl")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/model.mtl").write_text("# of another")
    code, text = batch(source, "-o", "out", "--format", "obj")
    assert code == 1 and "out/model.mtl exists" in text
    assert (tmp_path / "out/model.mtl").read_text() == "# of another"


def test_same_file_twice_is_unwrapped_once(batch, files, tmp_path):
    cube()
    source = files("a.obj")
    (tmp_path / "link.obj").symlink_to(source)
    code, text = batch("a.obj", tmp_path / "a.obj", "link.obj", "-o", "out", "--report", "r.json")
    assert code == 0 and text.count("is the same file as a.obj: unwrapped once") == 2
    assert read_report("r.json")["summary"]["assets"] == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.stl", "b.obj", "-o", ".", "--format", "obj"], "b.obj would be overwritten by its own result"),
        (["a.stl", "-o", "a.obj", "--report", "a.obj"], "is an input or an output"),
        (["a.stl", "-o", "out", "--report", "a.stl"], "is an input or an output"),
    ],
)
def test_plans_that_would_lose_a_file_are_wrong_usage(batch, files, arguments, message):
    cube()
    files("a.stl")
    files("b.obj")
    code, text = batch(*arguments)
    assert code == 2 and message in text


def test_a_free_name_is_found_for_each_of_many(addon):
    """Names are found for any number of inputs that meet."""
    plan, notes = addon("batch.plan").plan_outputs(
        ["m.stl", "m.gltf", "m.glb", "m.stl.glb", "m.ply"], "out", kind="glb"
    )
    names = [planned.target.name for planned in plan]
    assert names == ["m.stl.2.glb", "m.gltf.glb", "m.glb", "m.stl.glb", "m.ply.glb"] and not notes


# What is no regular file ---------------------------------------------------------------------------------------------


@pytest.mark.skipif(os.name == "nt", reason="no pipes and few links there")
def test_what_is_no_regular_file_is_said_and_the_others_are_done(run_script, files, tmp_path):
    cube()
    files("good.obj")
    os.mkfifo(tmp_path / "pipe.obj")
    (tmp_path / "loop.obj").symlink_to("again.obj")
    (tmp_path / "again.obj").symlink_to("loop.obj")
    (tmp_path / "nowhere.obj").symlink_to("missing.obj")
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "device.obj").symlink_to("/dev/zero")
    names = ["pipe.obj", "loop.obj", "nowhere.obj", "folder.obj", "device.obj", "good.obj"]
    done = run_script("unwrap.py", *names, "-o", "out", "--report", "r.json", "--resume")
    assert done.returncode == 1 and "Traceback" not in done.stdout, done.stdout
    errors = {asset["in"]: asset["error"] for asset in read_report(tmp_path / "r.json")["assets"]}
    assert errors == {
        "pipe.obj": "is a pipe, not a regular file",
        "loop.obj": "is a loop of symbolic links",
        "nowhere.obj": "is a link to a file that is not there",
        "folder.obj": "is a directory, not a regular file",
        "device.obj": "is a device, not a regular file",
        "good.obj": None,
    }


@pytest.mark.skipif(os.name == "nt", reason="few links there")
def test_output_that_is_a_loop_of_links_is_replaced_or_said(batch, files, tmp_path):
    cube()
    source = files("a.obj")
    (tmp_path / "out").symlink_to("tuo")
    (tmp_path / "tuo").symlink_to("out")
    code, text = batch(source, "-o", "out")
    assert code == 2 and "is not a directory" in text
    (tmp_path / "to").mkdir()
    (tmp_path / "to/a.obj").symlink_to("a.obj")
    assert batch(source, "-o", "to")[0] == 0
    assert (tmp_path / "to/a.obj").stat().st_size > 0


@pytest.mark.skipif(os.name == "nt", reason="no pipes there")
def test_pipe_as_the_buffer_of_a_gltf_is_not_opened(addon, tmp_path):
    """Only regular files are read for their digest: a pipe would wait, a device never end."""
    inputs, asset_io = addon("input_file"), addon("asset_io")
    os.mkfifo(tmp_path / "a.bin")
    content = {"buffers": [{"uri": "a.bin"}, {"uri": "data:,x"}, {}], "images": [{"uri": "my%20picture.png"}]}
    (tmp_path / "a.gltf").write_text(json.dumps(content))
    named = asset_io.named_files(tmp_path / "a.gltf")
    assert [path.name for path in named] == ["a.bin", "my picture.png"]
    assert [inputs.Digests().of(path) for path in named] == [None, None]
    assert inputs.Digests().of("/dev/zero") is None
    for text in ("", "{", "[]", '{"buffers": 3}', '{"buffers": [3]}', "glTF"):
        (tmp_path / "a.gltf").write_text(text)
        assert asset_io.named_files(tmp_path / "a.gltf") == []
