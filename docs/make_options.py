#!/usr/bin/env python3
"""Writes the tables of options in docs/guide.md from the rows that the command line and Python are made of; a test compares them.

  docs/make_options.py             needs the package with its renderer
  docs/make_options.py --check     changes nothing; exit code 1 if the page is not what the rows say

They stand between `<!-- options -->` and `<!-- end -->`.
"""

import argparse
import itertools
import pathlib
import re
import sys

from warpath import _core, _renderer

PAGE = pathlib.Path(__file__).resolve().parent / "guide.md"
MARKER = re.compile(r"(<!-- options -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def cell(text):
    return text.replace("|", "\\|") or "–"


def row(name, values, default, what, families):
    used_by = ", ".join(f"`{family}`" for family in families)
    return [f"`--{name.replace('_', '-')}`", cell(values), cell(default), cell(what), used_by]


def table(group, options):
    """Lines; who uses an option only where somebody does not."""
    rows = [row(name, values, default, what, families) for name, _, what, values, default, families in options]
    heads = ["option", "values", "default", "what it is", "of"]
    if not any(cells[-1] for cells in rows):
        heads, rows = heads[:-1], [cells[:-1] for cells in rows]
    lines = ["| " + " | ".join(cells) + " |" for cells in (heads, *rows)]
    lines.insert(1, "|" + "---|" * len(heads))
    return "\n".join([f"### {group}", "", *lines, "", ""])


def written(page):
    options = [*_renderer.scene_options(), *_renderer.render_options(), *_core.training_options()]
    tables = [table(group, list(members)) for group, members in itertools.groupby(options, key=lambda option: option[1])]
    after, places = MARKER.subn(lambda place: place[1] + "\n" + "".join(tables) + place[3], page)
    if places != 1:
        sys.exit("docs/guide.md has no one place for the options")
    return after


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing; exit code 1 if the page is not what the rows say")
    check = parser.parse_args().check
    before = PAGE.read_text(encoding="utf-8")
    after = written(before)
    if check and after != before:
        sys.exit("docs/guide.md is not what the options are: run docs/make_options.py")
    if not check:
        PAGE.write_text(after, encoding="utf-8")


if __name__ == "__main__":
    main()
