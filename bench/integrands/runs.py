"""The runs of a race, kept in a file as they end: one that was interrupted goes on where it was."""
import json
from pathlib import Path

from contenders import CONTENDERS, NEVAL, Outcome


class Runs:
    """A line of JSON for each run: contender, task, seed, neval of an iteration, and what came out."""

    def __init__(self, path=None):
        self.path = Path(path) if path else None
        self.known = {}
        if self.path and self.path.exists():
            for line in self.path.read_text().splitlines():
                run = json.loads(line)
                self.known[run["contender"], run["task"], run["seed"], run["neval"]] = Outcome(**run["outcome"])

    def get(self, contender, task, seed, neval=NEVAL):
        key = (contender, task.name, seed, neval)
        if key not in self.known:
            outcome = self.known[key] = CONTENDERS[contender](task, seed, neval)
            if self.path:
                line = {"contender": contender, "task": task.name, "seed": seed, "neval": neval, "outcome": outcome._asdict()}
                with self.path.open("a") as file:
                    file.write(json.dumps(line, default=float) + "\n")
        return self.known[key]
