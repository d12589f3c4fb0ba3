"""What operators tell a live station: start, stop, another rig, masks; who may, and what it costs."""
import json
import math
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time

import pytest
import stageclient

from conftest import STAGECTL, ctl, simulated
from station import ask, read_reply

SHIFT_M = 0.1


@pytest.fixture
def own_config(recording, tmp_path):
    """The simulated cameras with a rig of the test's own."""
    place = tmp_path / "own"
    place.mkdir()
    shutil.copytree(recording / "rig", place / "rig")
    shutil.copy(recording / "layout.yaml", place)
    config = place / "stage.yaml"
    config.write_text(simulated(recording, rate_hz=60))
    return config


def idle(start, config):
    station = start(config, options=["--idle"])
    deadline = time.monotonic() + 5
    while station.ctl("status").returncode and time.monotonic() < deadline:
        time.sleep(0.05)
    return station


def rotate(r, v):
    """Rodrigues' formula."""
    angle = math.sqrt(sum(x * x for x in r)) or 1e-30
    k = [x / angle for x in r]
    cross = [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]]
    along = sum(a * b for a, b in zip(k, v)) * (1 - math.cos(angle))
    return [v[i] * math.cos(angle) + cross[i] * math.sin(angle) + k[i] * along for i in range(3)]


def move_stage(rig):
    """The same cameras, seen from a stage frame SHIFT_M farther down the x axis."""
    for model in rig.glob("*.cameramodel"):
        text = model.read_text()
        found = re.search(r"('extrinsics': \[)([^\]]*)", text)
        rt = [float(x) for x in found.group(2).split(",") if x.strip()]
        turned = rotate(rt[:3], [SHIFT_M, 0, 0])
        moved = rt[:3] + [t - d for t, d in zip(rt[3:], turned)]
        model.write_text(text.replace(found.group(0),
                                      found.group(1) + ", ".join(map(repr, moved)) + ", "))


def test_start_and_stop_work_again_and_again(start, own_config):
    station = idle(start, own_config)
    assert station.status()["state"] == "configured"
    assert station.ctl("stop").returncode == 7
    for run in (1, 2, 3):
        assert station.ctl("start").stdout == "running\n"
        refused = station.ctl("start")
        assert refused.returncode == 7 and "running" in refused.stderr
        station.wait_running(3)
        begin = time.monotonic()
        assert json.loads(station.ctl("stop", "--json").stdout) == {"state": "configured",
                                                                     "run": run}
        assert time.monotonic() - begin < 1
        shots = station.status()["shots"]
        assert shots["solved"] > 0 and shots["lost"] == 0


def test_subscriber_is_told_of_each_run(start, own_config):
    station = idle(start, own_config)
    runs = []
    client = stageclient.connect(str(station.socket_dir / "stream.sock"), timeout_s=10)
    for run in (1, 2):
        station.ctl("start")
        for event in client:
            if isinstance(event, stageclient.MarkerSet):
                if client.description.run == run:
                    runs.append(run)
                    break
        station.ctl("stop")
    assert runs == [1, 2]


def test_calibrating_shows_images_and_makes_no_markers(start, own_config, tmp_path):
    station = idle(start, own_config)
    client = station.connect("control.sock")
    assert ask(client, "org.stage.Control.Calibrate")["parameters"]["state"] == "calibrating"
    picture = tmp_path / "ir0.png"
    assert station.ctl("camera", "preview", "ir0", "--output", picture).returncode == 0
    assert picture.exists()
    assert station.status()["stream"]["sets_published"] == 0
    refused = ask(client, "org.stage.Control.Start")
    assert refused["error"] == "org.stage.Control.WrongState"
    assert refused["parameters"]["state"] == "calibrating"
    assert ask(client, "org.stage.Control.Stop")["parameters"]["state"] == "configured"


def test_status_is_followed_once_a_second(shared_station):
    with subprocess.Popen([STAGECTL, "status", "--follow", "--json", "--socket-dir",
                           str(shared_station.socket_dir)], stdout=subprocess.PIPE,
                          text=True) as follower:
        begin = time.monotonic()
        solved = [json.loads(follower.stdout.readline())["shots"]["solved"] for _ in range(4)]
        passed_s = time.monotonic() - begin
        follower.kill()
    assert 1.8 < passed_s < 4.5
    assert all(30 < after - before < 120 for before, after in zip(solved[1:], solved[2:]))


def follow(station):
    """The error of the first reply, None when it is the status; and the connection."""
    client = station.connect("control.sock")
    client.sendall(json.dumps({"method": "org.stage.Control.GetStatus", "more": True}).encode()
                   + b"\0")
    return read_reply(client).get("error"), client


def test_who_follows_leaves_places_for_who_commands(start, own_config):
    station = idle(start, own_config)
    followers = [follow(station) for _ in range(16)]
    assert [error for error, _ in followers] == [None] * 12 + ["org.stage.Control.TooMany"] * 4
    for error, client in followers:
        if error:
            client.close()
    assert station.ctl("start").returncode == 0
    done = station.ctl("status", "--follow")
    assert done.returncode == 7 and "no more than 12" in done.stderr
    others = [station.connect("control.sock") for _ in range(4)]
    done = station.ctl("stop")
    assert done.returncode == 7 and "no more than 16" in done.stderr
    for client in others:
        client.close()
    assert station.ctl("stop").returncode == 0


def answer_with(place, reply):
    """Is a station for one call."""
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    listening.bind(str(place / "control.sock"))
    listening.listen()

    def answer():
        client, _ = listening.accept()
        client.recv(65536)
        client.sendall(reply + b"\0")
        client.close()
        listening.close()
    threading.Thread(target=answer, daemon=True).start()


@pytest.mark.parametrize("verb", [("start",), ("stop",), ("rig", "reload")])
def test_a_reply_without_what_it_should_say_is_told(verb):
    with tempfile.TemporaryDirectory(prefix="stage-test-") as place:
        answer_with(pathlib.Path(place), b'{"parameters":{}}')
        done = ctl(*verb, "--socket-dir", place)
    assert done.returncode == 5 and "no station" in done.stderr, done


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_who_is_in_no_group_is_told_so(start, sim_config):
    with tempfile.TemporaryDirectory(prefix="stage-test-") as place:
        os.chmod(place, 0o755)
        start(sim_config, socket_dir=place).wait_running()
        done = subprocess.run([STAGECTL, "stop", "--socket-dir", place], user=65534, group=65534,
                              extra_groups=[], capture_output=True, text=True, timeout=10,
                              check=False)
    assert done.returncode == 8 and "group" in done.stderr and "stage-operator" in done.stderr


def test_more_gives_replies_that_continue(shared_station):
    client = shared_station.connect("control.sock")
    client.sendall(json.dumps({"method": "org.stage.Control.GetStatus", "more": True}).encode()
                   + b"\0")
    for _ in range(2):
        reply = read_reply(client)
        assert reply["continues"] is True and reply["parameters"]["status"]["state"] == "running"


def test_rig_is_swapped_at_a_shot_boundary_and_no_shot_is_lost(start, own_config):
    station = start(own_config).wait_running()
    client = stageclient.connect(str(station.socket_dir / "stream.sock"), timeout_s=10)
    move_stage(own_config.parent / "rig")
    reload = None
    shots, x_by_shot, serials, revisions = [], {}, {}, {}
    for event in client:
        if not isinstance(event, stageclient.MarkerSet):
            continue
        shots.append(event.shot)
        serials[event.shot] = event.rig_serial
        assert event.rig_serial == client.description.rig_serial
        revisions[event.rig_serial] = client.description.rig_revision
        x_by_shot[event.shot] = {m.label: m.x_m for m in event.markers
                                 if m.label >= 0 and m.status == stageclient.MEASURED}
        if len(shots) == 20:
            reload = subprocess.Popen([STAGECTL, "rig", "reload", "--json", "--socket-dir",
                                       str(station.socket_dir)], stdout=subprocess.PIPE, text=True)
        if event.rig_serial == 2 and len(shots) > 300 or len(shots) > 1200:
            break
    told = json.loads(reload.communicate(timeout=10)[0])
    assert shots == list(range(shots[0], shots[0] + len(shots)))
    assert client.sets_lost == 0
    assert set(revisions) == {1, 2} and revisions[1] != revisions[2]
    assert told == {"rig_revision": revisions[2], "rig_serial": 2}
    changes = [s for s in shots[1:] if serials[s] != serials[s - 1]]
    assert len(changes) == 1
    for shot in shots[1:]:
        common = x_by_shot[shot].keys() & x_by_shot[shot - 1].keys()
        if not common:
            continue
        moved = sorted(x_by_shot[shot][m] - x_by_shot[shot - 1][m] for m in common)
        expected = SHIFT_M if shot == changes[0] else 0
        assert abs(moved[len(moved) // 2] - expected) < 0.02, shot
    after = [x_by_shot[s] for s in shots if s > changes[0] + 60]
    assert sum(map(len, after)) > 40 * len(after)
    assert station.status()["rig_revision"] == revisions[2]


def test_bad_rig_is_refused_and_the_old_one_stays(start, own_config):
    station = start(own_config).wait_running()
    before = station.status()["rig_revision"]
    (own_config.parent / "rig" / "ir2.cameramodel").write_text("{ 'lensmodel': 'nonsense' }\n")
    refused = station.ctl("rig", "reload")
    assert refused.returncode == 3 and "ir2.cameramodel" in refused.stderr
    status = station.status()
    assert status["rig_revision"] == before and status["rig_serial"] == 1
    assert status["state"] == "running"


def test_masked_area_hides_its_spots_until_it_is_lifted(start, own_config):
    text = own_config.read_text()
    name = re.search(r"name: (ir3)", text).group(0)
    own_config.write_text(text.replace(
        name, name + ", mask: [{x: 0, y: 0, width: 1280, height: 1024}]"))
    station = start(own_config).wait_running()
    client = station.connect("control.sock")

    def spots(camera):
        return len(ask(client, "org.stage.Control.Preview", camera=camera)["parameters"]["blobs"])

    assert spots("ir3") == 0 and spots("ir0") > 20
    assert "parameters" in ask(client, "org.stage.Control.SetMask", camera="ir3", areas=[])
    whole = [{"x": 0, "y": 0, "width": 1280, "height": 1024}]
    assert "error" not in ask(client, "org.stage.Control.SetMask", camera="ir0", areas=whole)
    time.sleep(0.2)
    assert spots("ir3") > 20 and spots("ir0") == 0
    status = station.status()
    assert status["cameras"][0]["mask"] == whole and status["cameras"][3]["mask"] == []
    assert status["cameras"][0]["blobs_masked"] > 0
    for areas in (7, [{"x": 0}], whole * 17, [{**whole[0], "width": 0}]):
        refused = ask(client, "org.stage.Control.SetMask", camera="ir0", areas=areas)
        assert refused["error"] == "org.varlink.service.InvalidParameter"


def test_mask_that_cannot_be_is_named(own_config):
    text = own_config.read_text()
    own_config.write_text(text.replace("name: ir3", "name: ir3, mask: [{x: -1, y: 0, width: 5}]"))
    done = ctl("config", "check", own_config)
    assert done.returncode == 3
    assert "mask[0].x" in done.stderr and "mask[0].height" in done.stderr


def as_nobody(path, request):
    """The reply that a process without any of our rights gets."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        import socket
        os.setgroups([])
        os.setresgid(65534, 65534, 65534)
        os.setresuid(65534, 65534, 65534)
        client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        client.connect(str(path))
        client.sendall(json.dumps(request).encode() + b"\0")
        os.write(write_end, json.dumps(read_reply(client)).encode())
        os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end) as reply:
        told = reply.read()
    os.waitpid(child, 0)
    return json.loads(told)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_strangers_are_denied_and_told_which_group_it_takes(start, sim_config):
    with tempfile.TemporaryDirectory(prefix="stage-test-") as place:
        os.chmod(place, 0o755)
        path = pathlib.Path(place, "control.sock")
        start(sim_config, socket_dir=place).wait_running()
        path.chmod(0o666)
        for method, group in (("GetStatus", "stage"), ("Stop", "stage-operator")):
            reply = as_nobody(path, {"method": f"org.stage.Control.{method}"})
            assert reply == {"error": "org.stage.Control.PermissionDenied",
                             "parameters": {"method": f"org.stage.Control.{method}",
                                            "group": group}}
        assert "parameters" in as_nobody(path, {"method": "org.varlink.service.GetInfo"})
        assert json.loads(ctl("status", "--json", "--socket-dir", place).stdout)["state"] == "running"


def test_every_described_method_is_there_and_no_other(start, own_config):
    client = idle(start, own_config).connect("control.sock")
    for interface in ask(client, "org.varlink.service.GetInfo")["parameters"]["interfaces"]:
        text = ask(client, "org.varlink.service.GetInterfaceDescription",
                   interface=interface)["parameters"]["description"]
        assert f"\ninterface {interface}\n" in text
        methods = re.findall(r"^method (\w+)\(", text, re.M)
        errors = set(re.findall(r"^error (\w+) ?\(", text, re.M))
        assert len(methods) >= 2
        for method in methods:
            error = ask(client, f"{interface}.{method}").get("error", "")
            assert "NotFound" not in error and "NotImplemented" not in error
            if error.startswith(interface):
                assert error.rpartition(".")[2] in errors
        error = ask(client, f"{interface}.Explode")
        assert error == {"error": "org.varlink.service.MethodNotFound",
                         "parameters": {"method": f"{interface}.Explode"}}


def test_wrong_calls_get_the_standard_errors(shared_station):
    client = shared_station.connect("control.sock")
    assert ask(client, "org.varlink.service.GetInterfaceDescription",
               interface="org.nowhere")["error"].endswith("InterfaceNotFound")
    client.sendall(b'{"method":"org.stage.Control.GetStatus","parameters":[]}\0')
    reply = read_reply(client)
    assert reply["error"] == "org.varlink.service.InvalidParameter"
    assert reply["parameters"] == {"parameter": "parameters"}


def test_latencies_of_each_stage_add_up(shared_station):
    time.sleep(1.5)
    stages = {one["stage"]: one["run"] for one in shared_station.status()["latency"]}
    assert len(stages) == 6
    for one in stages.values():
        assert 0 <= one["p50_ms"] <= one["p90_ms"] <= one["p99_ms"] <= one["max_ms"]
        assert one["count"] > 30
    parts = sum(stages[s]["p50_ms"] for s in ("light_to_arrival", "arrival_to_blobs",
                                              "blobs_to_solved", "solved_to_sent"))
    assert abs(parts - stages["light_to_sent"]["p50_ms"]) < 0.25 * parts
    assert stages["light_to_arrival"]["p50_ms"] > 1  # the simulator's read-out time


def test_statistics_come_once_a_second_in_the_stream(shared_station):
    client = stageclient.connect(str(shared_station.socket_dir / "stream.sock"), timeout_s=10)
    seen = []
    for event in client:
        if isinstance(event, stageclient.Statistics):
            seen.append(event)
            if len(seen) == 3:
                break
    assert all(0.5e9 < b.time_ns - a.time_ns < 1.5e9 for a, b in zip(seen, seen[1:]))
    status = shared_station.status()
    assert seen[-1].state == "running" and seen[-1].run == status["run"]
    assert 0 < seen[-1].shots_solved <= status["shots"]["solved"]
    assert len(seen[-1].cameras) == len(client.description.cameras)
    assert [one.stage for one in seen[-1].latencies] == [one["stage"] for one in status["latency"]]
    assert seen[-1].sets.capacity == status["shots"]["sets_queue"]["capacity"]


def first_line(command, begin):
    """Of what it says on either output."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as told:
        line = next((line for line in told.stdout if line.startswith(begin)), None)
        told.kill()
    return line


def test_a_station_whose_markers_have_no_names_says_so_to_whoever_looks(start, own_config):
    text = own_config.read_text().replace("sim:ir0", "sim:was0")
    own_config.write_text(text.replace("sim:ir1", "sim:ir0").replace("sim:was0", "sim:ir1"))
    station = start(own_config).wait_running()
    stream = str(station.socket_dir / "stream.sock")
    with stageclient.connect(stream, timeout_s=10) as client:
        told = next(event.unnamed for event in client
                    if isinstance(event, stageclient.Statistics) and event.HasField("unnamed"))
    assert told.seconds >= 2 and told.spots > 30 and told.named < 3 and "swapped" in told.remedy
    assert station.status()["unnamed"]["remedy"] == told.remedy
    for command in ([STAGECTL, "stream", "tap", "--socket-dir", station.socket_dir],
                    [os.environ["SUBSCRIBE_C"], stream],
                    [sys.executable, os.environ["SUBSCRIBE_PY"], stream]):
        assert first_line(command, "no names for ").endswith(f"{told.remedy}\n")


def resident_kb(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1])


def test_memory_stays_flat(start, own_config):
    station = start(own_config).wait_running()
    with subprocess.Popen([STAGECTL, "status", "--follow", "--socket-dir",
                           str(station.socket_dir)], stdout=subprocess.DEVNULL) as follower, \
         subprocess.Popen([STAGECTL, "stream", "tap", "--socket-dir", str(station.socket_dir)],
                          stdout=subprocess.DEVNULL) as tap:
        for _ in range(8):  # until there has been room for two rigs at once
            station.ctl("rig", "reload")
        time.sleep(2)
        before_kb = resident_kb(station.process.pid)
        for _ in range(5):
            time.sleep(5)
            station.ctl("rig", "reload")
        after_kb = resident_kb(station.process.pid)
        follower.kill()
        tap.kill()
    assert station.status()["rig_serial"] == 14
    assert after_kb - before_kb < 2048, (before_kb, after_kb)


def test_what_cannot_be_done_now_is_told_with_its_remedy(start, own_config):
    station = idle(start, own_config)
    told = station.ctl("status").stdout
    assert "SCHED_FIFO" not in told  # not asked for yet
    assert re.search(r"^arrival_to_sent( +-){8}$", told, re.M)  # no shot, no latency
    assert "nothing runs" in station.ctl("stop").stderr
    station.ctl("start")
    assert "SCHED_FIFO" in station.ctl("status").stdout
    refused = station.ctl("start")
    assert refused.returncode == 7 and "stagectl stop first" in refused.stderr


def test_mask_is_found_set_saved_and_read_again(start, own_config, tmp_path):
    masks = own_config.parent / "masks.yaml"
    own_config.write_text(own_config.read_text().replace("scene: talking", "scene: rest") +
                          "masks: masks.yaml\n")
    station = start(own_config)
    station.wait_running()
    found = station.ctl("camera", "mask", "ir0", "--auto", "--seconds", "1", "--save", str(masks),
                        "--json")
    assert found.returncode == 0
    areas = json.loads(found.stdout)["mask"]
    assert 1 <= len(areas) <= 16
    shown = json.loads(station.ctl("camera", "mask", "ir0", "--json").stdout)
    assert shown == {"camera": "ir0", "mask": areas}
    cleared = station.ctl("camera", "mask", "ir0", "--clear")
    assert cleared.stdout == "mask: []\n"
    assert json.loads(station.ctl("camera", "mask", "ir0", "--json").stdout)["mask"] == []
    wrong = station.ctl("camera", "mask", "nobody", "--auto")
    assert wrong.returncode != 0 and "nobody" in wrong.stderr
    station.stop()
    again = start(own_config, socket_dir=tmp_path / "again")
    again.wait_running()
    assert json.loads(again.ctl("camera", "mask", "ir0", "--json").stdout)["mask"] == areas
    masks.write_text("masks:\n- {camera: ir9, mask: []}\n")
    checked = ctl("config", "check", str(own_config))
    assert checked.returncode == 3 and "no camera ir9 of role ir" in checked.stderr


def write_pgm(path, rows):
    path.write_bytes(b"P5\n%d %d\n255\n" % (len(rows[0]), len(rows)) + rows.tobytes())


def test_noise_of_a_camera_is_measured_from_a_recording(tmp_path):
    numpy = pytest.importorskip("numpy")
    random = numpy.random.default_rng(1)
    light = numpy.tile(numpy.linspace(10, 220, 640), (200, 1))
    table = ["shot,mid_exposure_ns,uncertainty_ns,file"]
    for shot in range(6):
        image = light + random.normal(size=light.shape) * numpy.sqrt(4 + light / 25)
        write_pgm(tmp_path / f"{shot}.pgm", numpy.clip(numpy.rint(image), 0, 255).astype("uint8"))
        table.append(f"{shot},{1000000000 + 8333333 * shot},1000,{shot}.pgm")
    (tmp_path / "frames.csv").write_text("\n".join(table) + "\n")
    measured = ctl("camera", "noise", f"files:{tmp_path}", "--json")
    assert measured.returncode == 0, measured.stderr
    noise = json.loads(measured.stdout)
    assert abs(noise["electrons_per_grey"] / 25 - 1) < 0.1
    told = ctl("camera", "noise", f"files:{tmp_path}")
    assert "electrons_per_grey:" in told.stdout
    write_pgm(tmp_path / "0.pgm", numpy.full((200, 640), 10, "uint8"))
    (tmp_path / "frames.csv").write_text("\n".join(table[:2]) + "\n")
    refused = ctl("camera", "noise", f"files:{tmp_path}")
    assert refused.returncode == 3 and "fewer than two images" in refused.stderr
