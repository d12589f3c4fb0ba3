"""The code of writing-a-driver.md is the code that is compiled and tested."""
import pathlib
import re

import pytest

HERE = pathlib.Path(__file__).parent
PAGE = (HERE.parent / "writing-a-driver.md").read_text()


def code_of(name):
    """The blocks of the page that are marked as parts of this file, one after the other."""
    return "\n".join(re.findall(rf"^```c {re.escape(name)}\n(.*?)^```$", PAGE, re.M | re.S))


@pytest.mark.parametrize("name", ["pattern.h", "pattern.c", "contract_pattern.c"])
def test_the_page_and_the_compiler_read_the_same_text(name):
    assert code_of(name) == (HERE / name).read_text()
