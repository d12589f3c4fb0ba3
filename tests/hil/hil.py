#!/usr/bin/python3
"""./stage hil: the project's programs on devices of the kernel, in a virtual machine.

The machine is QEMU without hardware help: the host's root read only under a layer in memory, so the
programs of the build run as they are. docs/hil.md tells how it works and how a test is added.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
HERE = SOURCE / "tests/hil"
BOOT_SECONDS = 120  # for the machine to come up and to go down
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
    return ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-machine", "q35",
            "-smp", "2", "-m", "1024", "-nodefaults", "-no-user-config", "-display", "none", "-no-reboot",
            "-kernel", machine / "vmlinux", "-initrd", machine / "initramfs",
            "-append", "console=ttyS0 quiet mitigations=off panic=-1 preempt=full",
            "-serial", f"file:{share}/console",
            "-virtfs", "local,path=/,mount_tag=root,security_model=none,readonly=on,multidevs=remap",
            "-virtfs", f"local,path={share},mount_tag=hil,security_model=none"]


def furnish(share, machine, build, tests):
    """What the guest finds in the one directory that it may write."""
    shutil.copy(HERE / "guest_init", share / "init")
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


def judge(share, name):
    """The result of a test whose rc is there."""
    rc, start_s, end_s = (share / f"{name}.rc").read_text().split()
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
            "seconds": round(float(end_s) - float(start_s), 1), "reasons": reasons}


def tell(result, as_json):
    if as_json:
        return
    word = "FAIL" if result["failed"] else "skip" if not result["passed"] else "ok"
    print(f"{word:5}{result['name']:16}{result['passed']:4} passed {result['failed']:3} failed "
          f"{result['skipped']:3} skipped {result['seconds']:7.1f} s", flush=True)
    for reason in result["reasons"]:
        print(f"       {reason}", flush=True)


def boot(machine, build, tests, logs, as_json):
    """Runs the tests in one machine; results of those that it lived to end."""
    results = []
    with tempfile.TemporaryDirectory(prefix="stage-hil-") as name:
        share = pathlib.Path(name)
        furnish(share, machine, build, tests)
        deadline = time.monotonic() + BOOT_SECONDS + sum(seconds for _, seconds, _ in tests)
        guest = subprocess.Popen(qemu(machine, share), stdin=subprocess.DEVNULL)
        try:
            while True:
                over = guest.poll() is not None or time.monotonic() > deadline
                while len(results) < len(tests) and (share / f"{tests[len(results)][0]}.rc").exists():
                    results.append(judge(share, tests[len(results)][0]))
                    tell(results[-1], as_json)
                if over:
                    break
                time.sleep(0.2)
        finally:
            guest.kill()
            guest.wait()
            shutil.copytree(share, logs, dirs_exist_ok=True)
        if not (share / "rc").exists() and len(results) < len(tests):
            results.append({"name": tests[len(results)][0], "passed": 0, "failed": 1, "skipped": 0,
                            "seconds": 0.0, "reasons": [f"the machine died or hung in it: {logs}/console"]})
            tell(results[-1], as_json)
    return results


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
