#!/usr/bin/env python3
"""What CONTRIBUTING.md asks of the documentation, checked; and that its tables are what the records say.

  tests/docs_test.py [FOLDER]      the project's folder

Lines of prose have 120 characters at most, a paragraph or an item of a list 60 words; links lead somewhere, and every image is shown.
Tables, code and what stands in comments are no prose; addresses of links do not count.
"""
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop() if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]).resolve()
WIDTH, WORDS = 120, 60
ITEM = re.compile(r"\s*([-*]|\d+\.) ")


def pages():
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def prose(text):
    """Numbers and lines of what is to be read as sentences; an empty line in place of everything else."""
    text = re.sub(r"<!--.*?-->", lambda comment: "\n" * comment[0].count("\n"), text, flags=re.DOTALL)
    code = False
    for number, line in enumerate(text.splitlines(), 1):
        fence = line.lstrip().startswith("```")
        code ^= fence
        bare = line.lstrip().startswith(("|", "#", "![")) or code or fence
        yield number, "" if bare else re.sub(r"\]\([^)]*\)", "]", line).rstrip()


def paragraphs(text):
    """First line and words of each paragraph, and of each item of a list."""
    first, words = 0, []
    for number, line in [*prose(text), (0, "")]:
        if not line.strip() or ITEM.match(line):
            if words:
                yield first, words
            words = []
        first = first if words else number
        words += ITEM.sub("", line).split()


def anchors(page):
    """As GitHub makes them of headings."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def links(page):
    return re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))


class Documentation(unittest.TestCase):
    def nothing(self, found):
        if found:
            self.fail("\n".join(["", *found]))

    def test_lines_are_short(self):
        self.nothing([f"{page.relative_to(ROOT)}:{number}: {len(line)} characters"
                      for page in pages() for number, line in prose(page.read_text(encoding="utf-8")) if len(line) > WIDTH])  # fmt: skip

    def test_paragraphs_are_short(self):
        self.nothing([f"{page.relative_to(ROOT)}:{number}: {len(words)} words"
                      for page in pages() for number, words in paragraphs(page.read_text(encoding="utf-8")) if len(words) > WORDS])  # fmt: skip

    def test_links_lead_somewhere(self):
        broken = []
        for page in pages():
            for link in links(page):
                place, _, anchor = link.partition("#")
                target = page.parent / place if place else page
                if "://" in place or place.startswith("mailto:"):
                    continue
                if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target)):
                    broken.append(f"{page.relative_to(ROOT)}: {link}")
        self.nothing(broken)

    def test_every_image_is_shown(self):
        shown = {(page.parent / link).resolve() for page in pages() for link in links(page)}
        self.nothing([str(image.relative_to(ROOT)) for image in (ROOT / "docs" / "images").iterdir() if image.resolve() not in shown])

    def test_tables_are_what_the_records_say(self):
        done = subprocess.run([sys.executable, ROOT / "docs" / "make_results.py", "--check"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_every_record_is_shown(self):
        text = "".join(page.read_text(encoding="utf-8") for page in pages())
        markers = " ".join(re.findall(r"<!-- (?:table|text):.*?-->", text, flags=re.DOTALL))
        records = sorted((ROOT / "docs" / "results").glob("*.json"))
        self.nothing([record.name for record in records if not re.search(rf"(?<![\w-]){record.stem}(?![\w-])", markers)])


if __name__ == "__main__":
    unittest.main()
