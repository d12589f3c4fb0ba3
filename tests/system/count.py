"""What counts as passed, failed and skipped after a run of all tests."""
import json
import os
import subprocess
import sys

import pytest


def count(tmp_path, programs, cases):
    """(return code, last line, what it said) of programs [(name, result, stdout)], cases {name: XML}."""
    lines = [json.dumps({"name": name, "result": result, "stdout": stdout}) for name, result, stdout in programs]
    (tmp_path / "testlog.json").write_text("".join(f"{line}\n" for line in lines))
    suites = "".join(f'<testsuite name="stage.{name}">{xml}</testsuite>' for name, xml in cases.items())
    (tmp_path / "testlog.junit.xml").write_text(f"<testsuites>{suites}</testsuites>")
    done = subprocess.run([sys.executable, os.environ["COUNT_CASES"], tmp_path], capture_output=True, text=True)
    return done.returncode, done.stdout.splitlines()[-1], done.stderr


PASSED, FAILED, SKIPPED = "<testcase/>", "<testcase><failure/></testcase>", "<testcase><skipped/></testcase>"


@pytest.mark.parametrize("programs, cases, rc, line, said", [
    ([("a", "OK", "")], {"a": PASSED * 3}, 0, "3 passed, 0 failed, 0 skipped", ""),
    ([("a", "OK", "")], {}, 0, "1 passed, 0 failed, 0 skipped", ""),
    ([("a", "FAIL", "")], {"a": PASSED + FAILED}, 1, "1 passed, 1 failed, 0 skipped", ""),
    ([("a", "TIMEOUT", "")], {"a": PASSED}, 1, "1 passed, 1 failed, 0 skipped", "a: timeout\n"),
    ([("a", "SKIP", "")], {"a": SKIPPED}, 1, "0 passed, 0 failed, 1 skipped", ""),
    ([("a", "OK", ""), ("b", "SKIP", "1..0 # SKIP no device\n")], {"a": PASSED}, 0,
     "1 passed, 0 failed, 1 skipped", "b: skipped: no device\n"),
    ([("a", "OK", ""), ("b", "SKIP", "all well\n")], {"a": PASSED}, 1,
     "1 passed, 1 failed, 0 skipped", "b: told no case, nor why it was skipped\n"),
])
def test_a_program_counts_by_its_cases_and_a_skip_by_its_reason(tmp_path, programs, cases, rc, line, said):
    assert count(tmp_path, programs, cases) == (rc, line, said)


def test_no_tests_are_no_success(tmp_path):
    done = subprocess.run([sys.executable, os.environ["COUNT_CASES"], tmp_path], capture_output=True, text=True)
    assert done.returncode == 1 and done.stdout.endswith("0 passed, 0 failed, 0 skipped\n")
