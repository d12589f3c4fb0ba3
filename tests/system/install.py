"""meson install puts everything in place, and systemd has nothing to say against the unit."""
import os
import pathlib
import re
import shutil
import subprocess

import pytest

SYSTEMD_DIRS = ["/lib/systemd/system", "/usr/lib/systemd/system"]


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """A directory that everything was installed to."""
    place = tmp_path_factory.mktemp("root")
    done = subprocess.run([os.environ["MESON"], "install", "-C", os.environ["BUILD_DIR"],
                           "--no-rebuild", "--quiet", "--destdir", str(place)],
                          capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return place


def find(root, name):
    [path] = [path for path in root.rglob(name) if path.is_file()]
    return path


def inside(root, path):
    return root / str(path).lstrip("/")


def test_every_file_is_in_its_place(root):
    assert find(root, "staged.service").parent.match("lib/systemd/system")
    assert find(root, "70-stage.rules").parent.match("udev/rules.d")
    assert find(root, "60-stage.conf").parent.match("sysctl.d")
    assert find(root, "stage.conf").parent.match("sysusers.d")
    assert (root / "etc/stage/stage.yaml.example").is_file()
    assert not (root / "etc/stage/stage.yaml").exists()  # the operator's own
    for name in ["staged", "stagectl", "stage-guard", "gpio.md", "usb.md", "stage_client.h", "operators-guide.md",
                 "07-seventeen-minutes.yaml"]:
        find(root, name)


def test_the_unit_calls_what_was_installed(root):
    unit = find(root, "staged.service").read_text()
    calls = re.findall(r"^Exec\w+=(\S+)", unit, re.MULTILINE)
    assert len(calls) == 2
    for program in calls:
        assert os.access(inside(root, program), os.X_OK)
    [guide] = re.findall(r"^Documentation=file://(\S+)", unit, re.MULTILINE)
    assert inside(root, guide).is_file()


def needs(program):
    if not shutil.which(program):
        pytest.skip(f"{program} is not installed")


def test_systemd_has_nothing_to_say_against_the_unit(root):
    needs("systemd-analyze")
    own = [path for path in SYSTEMD_DIRS if pathlib.Path(path, "sysinit.target").exists()]
    if not own:
        pytest.skip("systemd's own units are not installed")
    unit_dir = find(root, "staged.service").parent
    for path in pathlib.Path(own[0]).glob("*.target"):  # that the unit is ordered against
        shutil.copy(path, unit_dir)
    done = subprocess.run(["systemd-analyze", "verify", f"--root={root}", "staged.service"],
                          capture_output=True, text=True, timeout=30, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_users_and_groups_can_be_made(root):
    needs("systemd-sysusers")
    done = subprocess.run(["systemd-sysusers", f"--root={root}"], capture_output=True, text=True,
                          timeout=30, check=False)
    assert done.returncode == 0, done.stderr
    groups = dict(line.split(":")[::2] for line in (root / "etc/group").read_text().splitlines())
    assert {"stage", "stage-operator"} <= set(groups)
    [user] = (root / "etc/passwd").read_text().splitlines()
    assert user.startswith("staged:") and user.split(":")[3] == groups["stage"]


def test_udev_rules_name_the_devices_of_a_stage(root):
    rules = [line for line in find(root, "70-stage.rules").read_text().splitlines()
             if line and not line.startswith("#")]
    for device in ["video4linux", "gpiochip*", '"0403"']:
        assert any(device in rule for rule in rules)
    for rule in rules:
        assert re.fullmatch(r'(\w+(\{\w+\})?(==|=)"[^"]+"(, )?)+', rule), rule
        assert 'GROUP="stage-operator"' in rule and 'MODE="0660"' in rule


@pytest.mark.parametrize("example", ["stage.yaml.example", "gpio.yaml.example"])
def test_the_examples_are_good_configs(root, recording, example):
    shutil.copy(root / "etc/stage" / example, recording / "example.yaml")
    done = subprocess.run([os.environ["STAGECTL"], "config", "check",
                           str(recording / "example.yaml")], capture_output=True, text=True,
                          timeout=10, check=False)
    assert done.returncode == 0, done.stderr
