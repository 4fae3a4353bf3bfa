"""What an experiment leaves for the documentation: rows of its tables, with the build, the machine and the settings that they are of."""

import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import time

import markdown
from tool import ROOT, SETTINGS, folder_of

RESULTS, IMAGES = ROOT / "docs" / "results", ROOT / "docs" / "images"


def write_record(name, tables, settings):
    """summary.json in the experiment's folder, and its tables on the terminal.

    tables: {name: rows}. settings: options of warpath that all of them share; files among them are left out.
    """
    shown = ", ".join(f"{key.replace('_', '-')} {value}" for key, value in settings.items() if not isinstance(value, (dict, pathlib.Path)))
    record = {"experiment": name, "command": f"experiments/run {name}", **provenance(name), "settings": shown, "tables": tables}
    path = folder_of(name) / "summary.json"
    path.write_text(in_lines(record), encoding="utf-8")
    for title, rows in tables.items():
        print("\n".join([f"{name}, {title}", "", *markdown.whole_table(rows), ""]))
    print(f"record: {path}", file=sys.stderr)


def provenance(name):
    """Version, build, date and machine of the runs in the experiment's folder; several builds are named all, with commas between them."""
    reports = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder_of(name).rglob("results.json"))]
    last = max(reports, key=lambda report: report["date"])
    return {
        "version": last["version"],
        "build": ", ".join(sorted({report["commit"] for report in reports})),
        "date": last["date"][:10],
        "machine": f"{last['threads']} threads of {last['cpu']}",
    }


def machine():
    """What of this machine's processor may be used, its name, and its widest vectors."""
    info = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    cpu = next((line.split(":", 1)[1].strip() for line in info.splitlines() if line.startswith("model name")), platform.machine())
    vectors = "AVX-512" if " avx512f " in info else "AVX2" if " avx2 " in info else "SSE"
    return f"{len(os.sched_getaffinity(0))} cores of {cpu}, {vectors}"


def record_of_bench(name, command, tables, settings=""):
    """The same of a benchmark in bench/, which runs what this checkout holds: as text."""
    describe = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
    build = subprocess.run(describe, cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    version = re.search(r"project\(warpath VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
    about = {"experiment": name, "command": command, "version": version, "build": build, "date": time.strftime("%Y-%m-%d", time.gmtime()),
             "machine": machine(), "settings": settings}  # fmt: skip
    return in_lines({**about, "tables": tables})


def in_lines(record):
    """JSON with a line for each row, which a diff shows well."""
    head = "".join(f" {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)},\n" for key, value in record.items() if key != "tables")
    bodies = [f"  {json.dumps(name)}: [\n" + ",\n".join("   " + json.dumps(rounded(row), ensure_ascii=False) for row in rows) + "\n  ]"
              for name, rows in record["tables"].items()]  # fmt: skip
    return "{\n" + head + ' "tables": {\n' + ",\n".join(bodies) + "\n }\n}\n"


def rounded(value):
    """Six digits of every number: more than any error leaves."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def keep(name):
    """Copies the record into docs/results, and into docs/images what pages show of the experiment's charts and pictures."""
    if SETTINGS.overrides:
        sys.exit("--keep is for experiments as they are, without other options")
    record = json.loads((folder_of(name) / "summary.json").read_text(encoding="utf-8"))
    if "," in record["build"] or "dirty" in record["build"]:
        sys.exit(f"{name} is of {record['build']}: a table names one build that can be had again; delete {folder_of(name)} and run it again")
    shutil.copy(folder_of(name) / "summary.json", RESULTS / f"{name}.json")
    pages = "".join(page.read_text(encoding="utf-8") for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
    for file in sorted(folder_of(name).rglob("*")):
        image = "-".join(file.relative_to(SETTINGS.out).with_suffix("").parts)
        if file.suffix in (".svg", ".jpg") and f"images/{image}{file.suffix}" in pages:
            shutil.copy(file, IMAGES / (image + file.suffix))
        elif file.suffix == ".png" and f"images/{image}.jpg" in pages:
            write_jpeg(file, IMAGES / f"{image}.jpg")
    print(f"kept: docs/results/{name}.json; docs/make_results.py writes the pages", file=sys.stderr)


def write_jpeg(source, target):
    try:
        from PIL import Image
    except ImportError:
        sys.exit("pictures for the documentation are written with Pillow: pip install pillow")
    Image.open(source).convert("RGB").save(target, quality=90, optimize=True)
