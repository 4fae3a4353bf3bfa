#!/usr/bin/env python3
"""Installs the C++ library into an empty folder, builds examples/cpp against it out of tree, and runs that.

  library_test.py BUILD SOURCE
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

build, source = (Path(a).resolve() for a in sys.argv[1:3])
with tempfile.TemporaryDirectory() as folder:
    prefix, example = Path(folder) / "prefix", Path(folder) / "example"
    subprocess.run(["cmake", "--install", build, "--component", "library", "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "-S", source / "examples" / "cpp", "-B", example, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Release"],
                   check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", example], check=True, stdout=subprocess.DEVNULL)
    output = subprocess.run([example / "integrate"], check=True, capture_output=True, text=True).stdout
print(output)
value, digits, exponent, exact = re.search(r"([\d.]+)\((\d+)\)e([-+]\d+), exactly (\S+)", output.splitlines()[-1]).groups()
error = int(digits) * 10.0 ** (int(exponent) - len(value.split(".")[1]))
pull = (float(value + "e" + exponent) - float(exact)) / error
# A false alarm in 5e8 runs, and the seed is always the same.
sys.exit(0 if abs(pull) < 6 and error < 0.01 * float(exact) else f"{pull:.1f} standard errors off, error {error:g}")
