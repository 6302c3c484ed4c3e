"""Links and pictures of the Markdown pages lead to files and headings that exist, and rows stand in
tables. The site's build knows its own pages only; README.md and bench/ are read elsewhere, too. The C++
reference has every public header."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")] + [
    page for folder in ("docs", "bench", "examples") for page in (ROOT / folder).rglob("*.md")
]


def prose_of(page: pathlib.Path) -> str:
    """A page's text without its blocks of code, in which a # begins no heading."""
    return re.sub(r"(?ms)^```.*?^```[^\n]*\n", "", page.read_text())


def anchors_of(page: pathlib.Path) -> set[str]:
    """The anchors of a page's headings: lower case, blanks become hyphens, punctuation is dropped."""
    headings = re.findall(r"(?m)^#+ (.*)", prose_of(page))
    return {re.sub(r"[^a-z0-9_-]", "", heading.replace(" ", "-").lower()) for heading in headings}


class Links(unittest.TestCase):
    def test_lead_to_files_and_headings(self) -> None:
        count = 0
        for page in PAGES:
            for target in re.findall(r"\]\(([^)\s]+)\)", prose_of(page)):
                if target.startswith("http"):
                    continue
                count += 1
                name, hash, anchor = target.partition("#")
                file = page.parent / name if name else page
                self.assertTrue(file.exists(), f"{page} links to {target}")
                if hash:
                    self.assertIn(anchor, anchors_of(file), f"{page} links to {target}")
        self.assertGreater(count, 50, "the pattern finds the links")


class Tables(unittest.TestCase):
    def test_begin_with_a_title(self) -> None:
        first_row = re.compile(r"(?:^|\n)(?!\|)[^\n]*\n(\|[^\n]*)\n([^\n]*)")
        count = 0
        for page in PAGES:
            for row, rule in first_row.findall(prose_of(page)):
                self.assertRegex(rule, r"^\|[ :|-]+\|$", f"{page}: a row outside of a table: {row}")
                count += 1
        self.assertGreater(count, 20, "the pattern finds the tables")


class Reference(unittest.TestCase):
    def test_has_every_public_header(self) -> None:
        reference = "".join(page.read_text() for page in (ROOT / "docs/api").iterdir())
        for folder in ("host/include/palpate", "driver/include/palpate"):
            for header in (ROOT / folder).iterdir():
                if header.name not in ("palpate.hpp", "api.hpp"):  # which declare nothing of their own
                    self.assertIn(f"```{{doxygenfile}} {header.name}\n", reference)
