"""What the tasks share: rows with bounds, how contenders are run, and the table."""
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "experiments"))
from records import machine

SIZE = "320x180"
#: Whom the tracer is compared with; the version that tests/mitsuba checks images against.
MITSUBA = "mitsuba==3.9.1"

#: GFLOP/s of a core of the machine that bounds in nanoseconds were set on.
PROTOTYPE_PEAK = 264


class Missing(Exception):
    """A peer or a scene that is not there, and why."""


@dataclass
class Bound:
    """What a row must show; `goal` is what would be even better."""

    least: float | None = None
    most: float | None = None
    goal: float | None = None

    def holds(self, value):
        return (self.least is None or value >= self.least) and (self.most is None or value <= self.most)

    def __str__(self):
        text = f"≥ {self.least:g}" if self.least is not None else f"≤ {self.most:g}"
        return text + (f" (goal {self.goal:g})" if self.goal is not None else "")


@dataclass
class Row:
    what: str
    value: float | None
    unit: str = ""
    bound: Bound | None = None
    note: str = ""
    task: str = ""

    def holds(self):
        return None if self.value is None or self.bound is None else self.bound.holds(self.value)

    def shown(self):
        if self.value is None:
            return "–"
        number = f"{self.value:.0f}" if abs(self.value) >= 1000 else f"{self.value:.3g}"
        return f"{number} {self.unit}".strip()

    def as_dict(self):
        """As a row of a record; see experiments/markdown.py."""
        return {"task": self.task, "what": self.what, "measured": self.shown(), "must show": str(self.bound or "–"), "note": self.note or "–"}


def tasks():
    return sorted(folder.parent.name for folder in HERE.glob("*/task.py"))


def table(rows):
    lines = [machine(), "", "| task | what | value | must show | holds | |", "|---|---|---|---|---|---|"]
    verdict = {None: "", True: "yes", False: "**no**"}
    lines += [f"| {r.task} | {r.what} | {r.shown()} | {r.bound or ''} | {verdict[r.holds()]} | {r.note} |" for r in rows]
    return "\n".join(lines)


class Bench:
    def __init__(self, build, scenes, torch):
        self.build, self.torch_python = Path(build).resolve(), torch
        self.scenes = Path(scenes) if scenes else None
        self.warpath = self.build / "warpath"

    def make(self):
        configure = ["cmake", "-G", "Ninja", "-S", HERE.parent, "-B", self.build, "-DWARPATH_BENCH=ON"]
        for command in (configure, ["ninja", "-C", self.build, "warpath", "benchmarks"]):
            subprocess.run(command, check=True, stdout=sys.stderr)

    def rows(self, task):
        """The task's rows; one that says what is missing, if something is."""
        spec = importlib.util.spec_from_file_location(f"{task}_task", HERE / task / "task.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        try:
            for row in module.rows(self):
                row.task = task
                yield row
        except Missing as missing:
            yield Row("not measured", None, note=str(missing), task=task)

    # Contenders: each prints one line of JSON at the end.

    def run(self, *command, environment=None):
        """What the command printed."""
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env={**os.environ, **(environment or {})}, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(str(c) for c in command)}: {(done.stderr or done.stdout).strip()}")
        return done.stdout

    def json(self, *command, environment=None):
        return json.loads(self.run(*command, environment=environment).strip().splitlines()[-1])

    def binary(self, name):
        path = self.build / f"bench_{name}"
        if not path.exists():
            raise Missing(f"{path.name} was not built: what it needs is not installed")
        return path

    def counters(self, name, benchmarks=".*"):
        """Results of a Google Benchmark binary by name: of each the fastest of nine, as the machine may have other work, which
        comes in bursts: the repetitions of all are run in a random order."""
        with tempfile.NamedTemporaryFile(suffix=".json") as out:
            command = [self.binary(name), f"--benchmark_filter={benchmarks}", f"--benchmark_out={out.name}", "--benchmark_min_time=0.15",
                       "--benchmark_repetitions=9", "--benchmark_enable_random_interleaving=true"]
            subprocess.run(command, check=True, capture_output=True)
            runs = [b for b in json.load(open(out.name))["benchmarks"] if b["run_type"] == "iteration"]
            return {b["name"]: b for b in sorted(runs, key=lambda b: -b["cpu_time"])}

    def scene(self, name):
        file = self.scenes and self.scenes / name / "scene.xml"
        if not file or not file.exists():
            raise Missing(f"no scene {name}: name the folder that has it with --scenes")
        return file

    def mitsuba(self, script, *arguments):
        """Runs a script with Mitsuba's Python."""
        python = self.build / "mitsuba" / "bin" / "python"
        if not python.exists():
            try:
                subprocess.run([sys.executable, "-m", "venv", python.parent.parent], check=True, capture_output=True)
                subprocess.run([python, "-m", "pip", "install", "-q", MITSUBA, "numpy"], check=True, capture_output=True)
            except subprocess.CalledProcessError as error:
                raise Missing(f"{MITSUBA} cannot be installed: {error.stderr.decode().strip().splitlines()[-1]}") from error
        return self.json(python, script, *arguments, environment=llvm())

    def torch(self, script, *arguments):
        if not self.torch_python:
            raise Missing("PyTorch: no --torch given")
        return self.json(self.torch_python, script, *arguments)


def llvm():
    """Mitsuba's LLVM variants crash on AVX-512 with LLVM 14 and 15, which they find first."""
    newer = sorted(Path("/usr/lib/x86_64-linux-gnu").glob("libLLVM.so.[12][0-9]*"))
    return {"DRJIT_LIBLLVM_PATH": str(newer[-1])} if newer and "DRJIT_LIBLLVM_PATH" not in os.environ else {}


def run_and_measure(command):
    """Seconds of a command from its start to its end, and the most memory that it held, in bytes."""
    start = time.perf_counter()
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{' '.join(str(c) for c in command)} failed")
    return time.perf_counter() - start, usage.ru_maxrss * 1024
