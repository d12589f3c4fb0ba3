"""Makes a C header of text files: embed_text.py OUTPUT NAME=FILE ..."""
import json
import pathlib
import sys

with open(sys.argv[1], "w", encoding="utf-8") as out:
    print("#pragma once", file=out)
    for argument in sys.argv[2:]:
        name, _, path = argument.partition("=")
        lines = pathlib.Path(path).read_text(encoding="ascii").splitlines(keepends=True)
        print(f"static const char {name}[] =", file=out)
        print("\n".join("\t" + json.dumps(line) for line in lines) + ";", file=out)
