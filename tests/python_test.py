#!/usr/bin/env python3
"""Installs the Python package into a virtual environment in the build folder, and runs its tests and the examples in its docstrings.

  python_test.py BUILD SOURCE

Where what it needs cannot be installed it says why and exits with 77: skipped.
"""
import os
import subprocess
import sys
import venv
from pathlib import Path

build, source = (Path(a).resolve() for a in sys.argv[1:3])
environment = build / "venv"
python = environment / "bin" / "python"


def pip_install(*arguments):
    return subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *arguments], capture_output=True, text=True)


if not python.exists():
    venv.create(environment, with_pip=True)
needed = pip_install("nanobind>=2.4", "scikit-build-core>=0.10", "numpy", "pytest")
if needed.returncode != 0:
    print("skipped: what the Python package is built with cannot be installed here:", needed.stderr.strip().splitlines()[-1:])
    sys.exit(77)
peers = {
    "vegas==6.4.1": "the test of its decorators is",
    "mitsuba==3.9.1": "the tests of warpath.mitsuba are",
    "matplotlib": "the tutorial is",
}
for peer, tests in peers.items():
    if pip_install(peer).returncode != 0:
        print(f"{peer} cannot be installed here, so {tests} skipped")
package = pip_install("--no-build-isolation", f"-Cbuild-dir={build / 'python_package'}", str(source))
if package.returncode != 0:
    sys.exit(package.stdout + package.stderr)
# The renderer is linked from what the build folder holds: compiling it once more would take minutes.
for command in (["cmake", "-S", source, "-B", build, "-DWARPATH_PYTHON=ON", f"-DPython_EXECUTABLE={python}"],
                ["cmake", "--build", build, "--target", "_renderer"],
                ["cmake", "--install", build, "--component", "python", "--prefix", next((environment / "lib").glob("python*/site-packages"))]):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stdout + done.stderr)
pytest = ["pytest", "-rs", source / "python" / "tests", "--pyargs", "warpath", "--doctest-modules", "--doctest-ignore-import-errors"]
found = os.environ | {"WARPATH_BINARY": str(build / "warpath"), "WARPATH_SOURCE": str(source)}
sys.exit(subprocess.run([python, "-m", *pytest, "-p", "no:cacheprovider"], cwd=build, env=found, check=False).returncode)
