#!/usr/bin/env python3
"""Our own files by rules that no compiler checks: flake8 finds nothing in Python, and no file of code is too long.

  lint_test.py FLAKE8 SOURCE
"""
import subprocess
import sys
import unittest
from pathlib import Path

FLAKE8, SOURCE = sys.argv[1], Path(sys.argv[2]).resolve()
#: What is ours; the rest of a checkout may be built or downloaded.
FOLDERS = ("bench", "docs", "examples", "experiments", "include", "python", "scenes", "src", "tests")
CODE = {".cpp", ".h", ".py", ".js", ".css", ".html", ".cmake"}
LINES = 400


def is_python(path):
    """By its name, or by its first line if its name does not say."""
    if path.suffix:
        return path.suffix == ".py"
    with open(path, "rb") as file:
        return file.readline().startswith(b"#!/usr/bin/env python3")


def files():
    for folder in FOLDERS:
        yield from (path for path in sorted((SOURCE / folder).rglob("*")) if path.is_file() and "__pycache__" not in path.parts)


class Lint(unittest.TestCase):
    def test_flake8_finds_nothing(self):
        scripts = [path for path in files() if is_python(path)]
        self.assertGreater(len(scripts), 50, "the scan no longer finds the Python files")
        done = subprocess.run([FLAKE8, "--config", SOURCE / ".flake8", *scripts], cwd=SOURCE, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, "\n" + done.stdout + done.stderr)

    def test_files_are_short(self):
        code = [path for path in files() if path.suffix in CODE or is_python(path)]
        self.assertGreater(len(code), 400, "the scan no longer finds the code")
        lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in code}
        long = [f"{path.relative_to(SOURCE)}: {count} lines" for path, count in lines.items() if count > LINES]
        self.assertEqual(long, [], f"files of more than {LINES} lines")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
