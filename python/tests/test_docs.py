"""What the documentation says is what the package does."""
import os
import pathlib
import subprocess
import sys

import pytest

SOURCE = pathlib.Path(os.environ.get("WARPATH_SOURCE", pathlib.Path(__file__).parents[2]))


def test_the_api_reference_is_what_the_docstrings_say():
    pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
    written = subprocess.run([sys.executable, SOURCE / "docs" / "make_api.py"], check=True, capture_output=True, text=True).stdout
    assert written == (SOURCE / "docs" / "api.md").read_text(), "run docs/make_api.py > docs/api.md"


def test_the_guide_lists_the_options_that_there_are():
    pytest.importorskip("warpath._renderer", reason="the renderer is not built in")
    done = subprocess.run([sys.executable, SOURCE / "docs" / "make_options.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_tutorial_runs_and_keeps_its_promises(tmp_path):
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    environment = {name: value for name, value in os.environ.items() if name != "DRJIT_LIBLLVM_PATH"}
    done = subprocess.run([sys.executable, "-W", "error::DeprecationWarning", SOURCE / "examples" / "python" / "tutorial.py", tmp_path], check=True,
                          capture_output=True, text=True, env=environment)
    pictures = {"first-integral", "own-integrand", "does-not-help"}
    if "Mitsuba 3 is not installed" not in done.stdout:
        pictures.add("mitsuba-scene")
    assert {file.stem for file in tmp_path.glob("*.png")} == pictures
    assert "grid+spline draws" in done.stdout and "too few points" in done.stdout
