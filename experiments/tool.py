"""Runs the `warpath` binary for the experiments, and reads what it leaves.

Every call leaves a record beside its output. A call whose record is there is not made again, and `compare` keeps the runs that it has
finished, so an experiment that was interrupted goes on where it was. Delete its folder to begin anew.
"""

import json
import os
import pathlib
import subprocess
import sys
from dataclasses import dataclass, field

ROOT = pathlib.Path(__file__).resolve().parent.parent


@dataclass
class Settings:
    """What the command line of experiments/run may set for all experiments."""

    warpath: pathlib.Path = ROOT / "build" / "warpath"
    out: pathlib.Path = ROOT / "out" / "experiments"
    overrides: dict = field(default_factory=dict)  # of options, such as {"size": "160x90"}


SETTINGS = Settings()


def shared_scene(name):
    """A scene that is not the project's own."""
    folder = os.environ.get("WARPATH_SCENES")
    if not folder:
        sys.exit("set WARPATH_SCENES to the folder that holds country-kitchen/ and white-room/ (README.md says where they are from)")
    scene = pathlib.Path(folder) / name / "scene.xml"
    if not scene.exists():
        sys.exit(f"{scene}: no such scene")
    return scene


def turned_scene(name):
    """A copy of a shared scene whose camera turns by `-D turn=DEGREES` to its left; everything but the scene file is linked to."""
    original = shared_scene(name)
    folder = folder_of(f"scenes/{name}")
    for entry in original.parent.iterdir():
        link = folder / entry.name
        if entry != original and not link.exists():
            link.symlink_to(entry.resolve())
    text = original.read_text(encoding="utf-8")
    camera = text.index("<matrix", text.index("<sensor"))
    text = text[:camera] + '<rotate y="1" angle="$turn" />' + text[camera:]
    first = text.index("<default")
    text = text[:first] + '<default name="turn" value="0" />' + text[first:]
    (folder / "scene.xml").write_text(text, encoding="utf-8")
    return folder / "scene.xml"


def own_scene(name):
    return ROOT / "scenes" / name / "scene.xml"


def stored_reference(name):
    """Options that name the stored reference image of a shared scene, at 320 x 180; none if it is not there or of another size."""
    folder = pathlib.Path(os.environ.get("WARPATH_REFERENCES", pathlib.Path(os.environ.get("WARPATH_SCENES", ".")) / ".." / "references"))
    image = folder / f"{name}.exr"
    fits = SETTINGS.overrides.get("size", "320x180") == "320x180"
    return {"reference": image} if fits and image.exists() else {}


#: Families that mix in a share of uniform samples that --uniform-share sets.
MIXED = ("grid", "kdtree", "realnvp", "spline", "conditional-kdtree", "conditional-spline")


def mixes(methods):
    """Whether --uniform-share is for any of these methods: the command line refuses options that none of them uses."""
    return any(str(method).partition(":")[0] in MIXED for method in methods)


def arguments(options, fixed=(), methods=()):
    """Options as the command line has them: max_depth=8 is --max-depth 8; `defines` are -D. What was set for all comes first,
    but for what is `fixed`."""
    words = []
    for name, value in options.items():
        if name == "defines":
            words += [word for key, item in value.items() for word in ("-D", f"{key}={item}")]
        else:
            words += [f"--{name.replace('_', '-')}", str(value if name in fixed else SETTINGS.overrides.get(name, value))]
    everywhere = ("seed", "uniform_share") if mixes(methods) else ("seed",)
    more = [key for key in everywhere if key in SETTINGS.overrides and key not in (*options, *fixed)]
    return words + [word for key in more for word in (f"--{key.replace('_', '-')}", SETTINGS.overrides[key])]


def crop(options, x, y, width, height):
    """An option that renders a part of the film alone, given in shares of its size."""
    across, down = (int(n) for n in SETTINGS.overrides.get("size", options["size"]).split("x"))
    return {"crop": f"{round(x * across)},{round(y * down)},{round(width * across)},{round(height * down)}"}


def run(label, action, *words):
    """CPU seconds and peak memory in bytes of one call of the binary, or of the same call when it was made before."""
    words = [str(word) for word in (action, *words)]
    record = folder_of(label) / f"{action}.json"
    if record.exists():
        done = json.loads(record.read_text(encoding="utf-8"))
        if done["words"] == words:
            return done["cpu_seconds"], done["peak_memory"]
    command = [str(SETTINGS.warpath), *words, *(("--resume",) if action == "compare" else ())]
    command += [word for key in ("threads",) if key in SETTINGS.overrides for word in (f"--{key}", SETTINGS.overrides[key])]
    print("$", " ".join(command), file=sys.stderr, flush=True)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        _, status, usage = os.wait4(process.pid, 0)
    except KeyboardInterrupt:
        process.wait()  # it keeps what it has
        sys.exit(f"{label}: interrupted")
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{label}: warpath failed")
    done = {"words": words, "cpu_seconds": usage.ru_utime + usage.ru_stime, "peak_memory": usage.ru_maxrss * 1024}
    record.write_text(json.dumps(done) + "\n", encoding="utf-8")
    return done["cpu_seconds"], done["peak_memory"]


def peak_memory(label, action):
    """In bytes, of a call that was made before."""
    return json.loads((folder_of(label) / f"{action}.json").read_text(encoding="utf-8"))["peak_memory"]


def folder_of(label):
    folder = SETTINGS.out / label
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def compare(label, scene, methods, **options):
    """The runs of `warpath compare`, whose report, images and results.json land in out/experiments/LABEL."""
    folder = folder_of(label)
    run(label, "compare", scene, "--methods", ",".join(map(str, methods)), "--report", folder, *arguments(options, methods=methods))
    with open(folder / "results.json", encoding="utf-8") as file:
        results = json.load(file)["results"]
    runs = int(SETTINGS.overrides.get("runs", options["runs"])) if "runs" in options else 1
    if len(results) < len(methods) * runs or any(run["spp"] < spp_of(options) for run in results):
        (folder / "compare.json").unlink()
        sys.exit(f"{label}: interrupted; the same command goes on with it")
    return results


def spp_of(options):
    """What every run has at least, if it was not cut off."""
    return float(SETTINGS.overrides.get("spp", options["spp"])) - 0.5 if "spp" in options else 0.0


def train(label, scene, warp, **options):
    """A trained warp's file, CPU seconds (candidates, fitting, loading the scene), peak memory in bytes."""
    file = folder_of(label) / "trained.warp"
    return file, *run(label, "train", scene, "--warp", warp, "-o", file, *arguments(options, methods=[warp]))


def render_reference(label, scene, spp, warp="field", **options):
    """Options that name an image to measure against, for scenes where plain path tracing would take too long to find the light."""
    image = folder_of(label) / "reference.exr"
    run(label, "render", scene, "--warp", warp, "-o", image, *arguments({"seed": 999, "spp": spp, **options}, fixed=("seed", "spp", "uniform_share")))
    return {"reference": image}


def render(label, scene, image, **options):
    """An image for its own sake."""
    run(label, "render", scene, "-o", image, *arguments(options))
