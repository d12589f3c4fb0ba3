#!/usr/bin/python3
"""./stage hil: the project's programs on devices of the kernel, in a virtual machine.

The machine is QEMU without hardware help; the programs of the build run in it as they are.
docs/hil.md tells how it works and how a test is added.
"""
import argparse
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import luggage

SOURCE = pathlib.Path(__file__).resolve().parents[2]
HERE = SOURCE / "tests/hil"
BOOT_SECONDS = 120  # for the machine to come up, or to go down, beside the time of a test
BUSY = 4  # seconds of a busy host for one of the guest's, which ends a test by its own clock
CASE = re.compile(r"^(not ok|ok)\b(?:.*?#\s*(SKIP)\b)?", re.M | re.I)
PLAN_SKIP = re.compile(r"^1\.\.0\b.*#\s*SKIP\s*(.*)", re.M | re.I)
KERNEL_COMPLAINT = re.compile(r".*(?:\bBUG\b|\bOops\b|WARNING:).*")


def read_tests(wanted):
    """[(name, seconds, command)] of the list, or of those that are wanted."""
    lines = [line.split(None, 2) for line in (HERE / "tests").read_text().splitlines()
             if line.strip() and not line.startswith("#")]
    unknown = set(wanted) - {name for name, _, _ in lines}
    if unknown:
        sys.exit(f"stage hil: no test {', '.join(sorted(unknown))}; "
                 f"there are {', '.join(name for name, _, _ in lines)}")
    return [(name, int(seconds), command.strip()) for name, seconds, command in lines
            if not wanted or name in wanted]


def prepare():
    """The directory of the machine, or None and why there is none to be had."""
    cache = SOURCE / ".cache/hil"
    done = subprocess.run([HERE / "machine.sh", cache], stdout=subprocess.PIPE, text=True)
    if done.returncode == 77:
        return None, done.stdout.strip()
    if done.returncode:
        sys.exit("stage hil: the virtual machine could not be prepared")
    return pathlib.Path(done.stdout.strip()), None


def qemu(machine, share):
    """icount: its clock counts its instructions, 2^2 ns each, and goes on to the next timer when it
    has nothing to do; how busy the host is it cannot tell. preempt=full: real-time threads wait for
    no long system call of another."""
    return ["qemu-system-x86_64", "-accel", "tcg", "-icount", "shift=2,sleep=off", "-cpu", "max", "-machine", "q35",
            "-m", "1536", "-nodefaults", "-no-user-config", "-display", "none", "-no-reboot",
            "-kernel", machine / "vmlinux", "-initrd", machine / "initramfs",
            "-append", "console=ttyS0 quiet mitigations=off panic=-1 preempt=full",
            "-serial", f"file:{share}/console",
            "-virtfs", f"local,path={share},mount_tag=hil,security_model=none"]


def furnish(share, machine, build, tests):
    """What the guest finds in the one directory that it may write."""
    luggage.pack(SOURCE, machine, build, share / "luggage.tar")
    (share / "environment").write_text(f"BUILD='{build}'\nSOURCE='{SOURCE}'\nMACHINE='{machine}'\n")
    (share / "tests").write_text("".join(f"{name} {seconds} {command}\n" for name, seconds, command in tests))


def count_cases(log, rc):
    """(passed, failed, skipped) of a test's words; one that failed in no case of its own is a failure."""
    cases = [(word.lower(), skip) for word, skip in CASE.findall(log)]
    failed = sum(word == "not ok" for word, _ in cases)
    skipped = sum(bool(skip) for word, skip in cases if word == "ok")
    passed = len(cases) - failed - skipped
    if PLAN_SKIP.search(log) and not cases and rc == 0:
        skipped = 1
    elif failed == 0 and (rc != 0 or not cases):
        failed = 1
    return passed, failed, skipped


def judge(share, name, seconds):
    """The result of a test whose rc is there; it took so many seconds of the host's."""
    rc = (share / f"{name}.rc").read_text()
    log = (share / f"{name}.log").read_text(errors="replace")
    passed, failed, skipped = count_cases(log, int(rc))
    reasons = [line for line in log.splitlines() if re.match(r"not ok|.*#\s*skip", line, re.I)]
    if int(rc) == 124:
        reasons.append("took too long")
    elif failed and not reasons:
        reasons.append(f"ended with {rc}")
    complaints = KERNEL_COMPLAINT.findall((share / f"{name}.dmesg").read_text(errors="replace"))
    if complaints:
        failed += 1
        reasons.append(f"the kernel complained: {complaints[0].strip()}")
    return {"name": name, "passed": passed, "failed": failed, "skipped": skipped,
            "seconds": round(seconds, 1), "reasons": reasons}


def tell(result, as_json):
    if as_json:
        return
    word = "FAIL" if result["failed"] else "skip" if not result["passed"] else "ok"
    print(f"{word:5}{result['name']:16}{result['passed']:4} passed {result['failed']:3} failed "
          f"{result['skipped']:3} skipped {result['seconds']:7.1f} s", flush=True)
    for reason in result["reasons"]:
        print(f"       {reason}", flush=True)


def failure(name, reason):
    return {"name": name, "passed": 0, "failed": 1, "skipped": 0, "seconds": 0.0, "reasons": [reason]}


def watch(guest, share, tests, as_json):
    """Results of tests as they come, until the guest ends or hangs."""
    results = []
    came = time.monotonic()
    while True:
        over = guest.poll() is not None
        while len(results) < len(tests) and (share / f"{tests[len(results)][0]}.rc").exists():
            now = time.monotonic()
            results.append(judge(share, tests[len(results)][0], now - came))
            tell(results[-1], as_json)
            came = now
        seconds = tests[len(results)][1] if len(results) < len(tests) else 0
        if over or time.monotonic() > came + BUSY * seconds + BOOT_SECONDS:
            return results
        time.sleep(0.2)


def boot(machine, build, tests, logs, as_json):
    """Runs tests in one machine: results of those up to the one that it did not survive."""
    with tempfile.TemporaryDirectory(prefix="stage-hil-") as name:
        share = pathlib.Path(name)
        furnish(share, machine, build, tests)
        guest = subprocess.Popen(qemu(machine, share), stdin=subprocess.DEVNULL)
        try:
            results = watch(guest, share, tests, as_json)
        finally:
            guest.kill()
            guest.wait()
            shutil.copytree(share, logs, dirs_exist_ok=True, ignore=shutil.ignore_patterns("luggage.tar"))
        if (share / "rc").exists() and len(results) == len(tests):
            return results
        came_up = (share / "boot.dmesg").exists()
        what = "died or hung" if came_up else "did not come up"
        left = tests[len(results):] or tests[-1:]
        broken = [failure(test[0], f"the machine {what}: {logs}/console") for test in (left[:1] if came_up else left)]
        for result in broken:
            tell(result, as_json)
        return results + broken


def run(machine, build, tests, as_json):
    """All tests; when the machine dies of one, the rest run in a new one."""
    subprocess.run([sys.executable, HERE / "pictures.py", build], check=True)
    logs = build / "hil-logs"
    shutil.rmtree(logs, ignore_errors=True)
    results = []
    while len(results) < len(tests):
        results += boot(machine, build, tests[len(results):], logs, as_json)
    return results


def main():
    parser = argparse.ArgumentParser(prog="stage hil", description=__doc__.splitlines()[0])
    parser.add_argument("build", help=argparse.SUPPRESS)
    parser.add_argument("tests", nargs="*", metavar="TEST", help="names of tests/hil/tests; all, when none is given")
    parser.add_argument("--json", action="store_true", help="one object with every result")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stage hil: told to end"))  # and the machine with it
    tests = read_tests(options.tests)
    machine, reason = prepare()
    if machine:
        results = run(machine, pathlib.Path(options.build).resolve(), tests, options.json)
    else:
        results = [{"name": name, "passed": 0, "failed": 0, "skipped": 1, "seconds": 0.0, "reasons": [reason]}
                   for name, _, _ in tests]
        for result in results:
            tell(result, options.json)
    passed, failed, skipped = (sum(result[kind] for result in results)
                               for kind in ("passed", "failed", "skipped"))
    if options.json:
        print(json.dumps({"passed": passed, "failed": failed, "skipped": skipped, "tests": results}, indent=1))
    else:
        print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
