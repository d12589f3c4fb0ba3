#!/usr/bin/python3
"""./stage release: the tests on another Debian and another processor, in directories of their own.

docs/release.md tells how it works. Nothing is installed into the machine but debootstrap, and nothing
stays mounted.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
HERE = SOURCE / "tests/release"
sys.path.insert(0, str(SOURCE / "tests"))
import count_cases  # noqa: E402

SKIP = 77
NAMESPACES = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]


def read_parts(wanted):
    """[(name, what part.sh wants to know)] of the list, or of those that are wanted."""
    lines = [line.split() for line in (HERE / "parts").read_text().splitlines()
             if line.strip() and not line.startswith("#")]
    unknown = set(wanted) - {line[0] for line in lines}
    if unknown:
        print(f"stage release: no part {', '.join(sorted(unknown))}; "
              f"there are {', '.join(line[0] for line in lines)}", file=sys.stderr)
        sys.exit(2)
    return [(line[0], line[1:]) for line in lines if not wanted or line[0] in wanted]


def as_root():
    """What to put before a command that needs root, or None and why it cannot be had."""
    before = [] if os.geteuid() == 0 else ["sudo", "-n"]
    try:
        done = subprocess.run([*before, *NAMESPACES, "true"], capture_output=True, text=True)
    except FileNotFoundError as error:
        return None, f"no {error.filename} here; run as root or with sudo"
    return (before, None) if done.returncode == 0 else (None, f"needs root: {done.stderr.strip()}")


def result_of(seconds, passed=0, failed=0, skipped=0, reasons=()):
    return {"passed": passed, "failed": failed, "skipped": skipped, "seconds": round(seconds, 1),
            "reasons": list(reasons)}


def failed_programs(logs):
    with open(logs / "testlog.json", encoding="utf-8") as lines:
        programs = [json.loads(line) for line in lines]
    return [f"{program['name']}: {program['result'].lower()}" for program in programs
            if count_cases.RESULTS.get(program["result"], count_cases.FAILED) == count_cases.FAILED]


def judge(rc, words, logs, seconds):
    if rc == SKIP:
        return result_of(seconds, skipped=1, reasons=[words])
    if not (logs / "testlog.json").exists():
        return result_of(seconds, failed=1, reasons=["it could not be built; see above"])
    passed, failed, skipped = count_cases.count_all(logs)
    reasons = failed_programs(logs)
    if rc and not failed:
        failed, reasons = 1, [f"meson ended with {rc}"]
    return result_of(seconds, passed, failed, skipped, reasons)


def run_part(before, name, wishes):
    """Its end of the pipe holds the part alive: whatever ends us ends it too, and its mounts."""
    root = SOURCE / ".cache/release" / name
    root.parent.mkdir(parents=True, exist_ok=True)
    began_s = time.monotonic()
    part = subprocess.Popen([*before, *NAMESPACES, HERE / "part.sh", SOURCE, root, *wishes],
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    words = part.stdout.read().strip()
    return judge(part.wait(), words, root / "stage/build/meson-logs", time.monotonic() - began_s)


def tell(result):
    word = "FAIL" if result["failed"] else "skip" if not result["passed"] else "ok"
    print(f"{word:5}{result['name']:16}{result['passed']:4} passed {result['failed']:3} failed "
          f"{result['skipped']:3} skipped {result['seconds']:7.1f} s", flush=True)
    for reason in result["reasons"]:
        print(f"       {reason}", flush=True)


def main():
    parser = argparse.ArgumentParser(prog="stage release", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART",
                        help="names of tests/release/parts; all, when none is given")
    parser.add_argument("--json", action="store_true", help="one object with every result")
    options = parser.parse_args()
    parts = read_parts(options.parts)
    before, reason = as_root()
    results = []
    for name, wishes in parts:
        result = run_part(before, name, wishes) if reason is None else result_of(0, skipped=1, reasons=[reason])
        results.append({"name": name, **result})
        if not options.json:
            tell(results[-1])
    passed, failed, skipped = (sum(result[kind] for result in results)
                               for kind in ("passed", "failed", "skipped"))
    if options.json:
        print(json.dumps({"passed": passed, "failed": failed, "skipped": skipped, "parts": results}, indent=1))
    else:
        print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
