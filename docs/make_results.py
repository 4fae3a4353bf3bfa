#!/usr/bin/env python3
"""Writes the tables of the documentation, and the figures in its text, from the records in docs/results; a test compares them.

  docs/make_results.py             after `experiments/run NAME --keep`
  docs/make_results.py --check     only says which pages are not what the records say

A page says between comments what it wants, and gets it:

  <!-- table: NAME/TABLE, ... | key, ... | only ROW; ... -->  ...  <!-- end -->
      Columns by the keys of the rows (`key as Heading` for another heading; a comma in a key is \\,), of all rows or some. Tables of
      several scenes stand side by side. Build, machine and command follow.
  <!-- text: words with {NAME/TABLE | ROW | key} among them -->  ...  <!-- end -->
      The same with figures.

NAME/TABLE is a table of docs/results/NAME.json, or NAME alone, if there is but one. A row's name is that of its method and what is special
about it, `field --objective mse`, or else what stands in its first column.
"""

import argparse
import json
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "experiments"))
import markdown

WIDTH = 120
MARKER = re.compile(r"(<!-- (table|text): (.*?)\s-->\n)(.*?)(<!-- end -->)", re.DOTALL)
#: What stands below a table.
CAPTION = "{commands}{settings}; build {build} of {date}, {machine}."


def pages():
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def record(name):
    path = ROOT / "docs" / "results" / f"{name}.json"
    if not path.exists():
        sys.exit(f"no record {path.relative_to(ROOT)}: experiments/run {name} --keep")
    return json.loads(path.read_text(encoding="utf-8"))


def rows_at(place):
    """The record, the table's name, and its rows by their names."""
    name, _, title = place.strip().partition("/")
    found = record(name)
    title = title or (next(iter(found["tables"])) if len(found["tables"]) == 1 else "")
    if title not in found["tables"]:
        sys.exit(f"{place}: docs/results/{name}.json has {', '.join(found['tables'])}")
    return found, title, {name_of(row): row for row in found["tables"][title]}


def name_of(row):
    first = next(iter(row.values()))
    return " ".join(str(part).replace("`", "") for part in (first, row.get("label", "")) if part)


def table(words):
    """Lines: the table that the words ask for, and what it is of."""
    places, keys, *only = (part.strip() for part in " ".join(words.split()).split("|"))
    sources = [rows_at(place) for place in places.split(",")]
    names = [name.replace("\\,", ",") for name in re.split(r"(?<!\\),", keys)]
    first, *columns = ([part.strip() for part in name.split(" as ")] for name in names)
    rows = {name: {first[0]: "–"} for _, _, found in sources for name in found}
    heads = [(first[0], first[1] if len(first) > 1 else "" if first[0] == "method" else markdown.heading(first[0]))]
    for _, title, found in sources:
        for key, *named in columns:
            head = named[0] if named else markdown.heading(key)
            heads.append((f"{title}/{key}", f"{markdown.title(title)}, {head}" if len(sources) > 1 else head))
            for name, row in found.items():
                rows[name] |= {first[0]: markdown.cell(row, first[0]), f"{title}/{key}": markdown.cell(row, key)}
    if only:
        wanted = [name.strip() for name in only[0].removeprefix("only ").split(";")]
        rows = {name: rows[name] for name in wanted}
    for row in rows.values():
        row |= {key: "–" for key, _ in heads if key not in row}
    lines = ["| " + " | ".join(head for _, head in heads) + " |", "|" + "---|" * len(heads)]
    lines += ["| " + " | ".join(row[key] for key, _ in heads) + " |" for row in rows.values()]
    return "\n".join(["", *lines, "", caption([found for found, _, _ in sources]), "", ""])


def caption(records):
    """One build, or the table is refused."""
    first = records[0]
    if any((other["build"], other["machine"]) != (first["build"], first["machine"]) for other in records):
        sys.exit("a table of several builds: " + ", ".join(f"{other['experiment']} {other['build']}" for other in records))
    commands = " ".join(dict.fromkeys(f"`{other['command']}`" for other in records))
    settings = f": {first['settings']}" if first["settings"] else ""
    line = CAPTION.format(**{**first, "commands": commands, "settings": settings, "build": first["build"][:7]})
    return textwrap.fill(line, WIDTH, break_long_words=False, break_on_hyphens=False)


def text(words):
    """The words with figures in place of {...}."""

    def figure(match):
        place, name, key = (part.strip() for part in match[1].split("|"))
        _, _, rows = rows_at(place)
        if key not in rows.get(name, {}):
            sys.exit(f"{{{match[1]}}}: no such figure; rows: {', '.join(rows)}")
        value = rows[name][key]
        return markdown.short(*value) if isinstance(value, list) else markdown.number(value)

    filled = re.sub(r"\{(.*?)\}", figure, words, flags=re.DOTALL)
    paragraphs = [" ".join(paragraph.split()) for paragraph in filled.split("\n\n")]
    return "\n\n".join(textwrap.fill(paragraph, WIDTH, break_long_words=False, break_on_hyphens=False) for paragraph in paragraphs) + "\n"


def written(page):
    make = {"table": table, "text": text}
    return MARKER.sub(lambda match: match[1] + make[match[2]](match[3]) + match[5], page)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing; exit code 1 if a page is not what the records say")
    options = parser.parse_args()
    stale = []
    for path in pages():
        before = path.read_text(encoding="utf-8")
        after = written(before)
        if after != before:
            stale.append(str(path.relative_to(ROOT)))
            if not options.check:
                path.write_text(after, encoding="utf-8")
    if stale:
        print("not what the records say: run docs/make_results.py" if options.check else "written:", *stale, sep="\n  ", file=sys.stderr)
    return 1 if options.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
