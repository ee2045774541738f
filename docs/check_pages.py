"""Looks into rendered pages for what their sources say.

    python docs/check_pages.py FOLDER    of ``sphinx-build docs FOLDER``; exit code 1 and a line for a fault

It finds three faults: a guide that another page has overwritten; a line that was taken for a comment; and a
list made of the initials of an author at the beginning of a line.
"""

import html
import re
import sys
from pathlib import Path

DOCS = Path(__file__).parent
CODE = re.compile(r"^```.*?^```$|^    .*?$|`[^`\n]*`|!\[[^\]]*\]\([^)]*\)|\]\([^)]*\)", re.M | re.S)
"""What is not prose: blocks and words of code, pictures, targets of links."""


def faults(folder: Path) -> list[str]:
    """Return a line for each fault of the pages in a folder."""
    found = []
    for source in sorted(DOCS.rglob("*.md")):
        name = source.relative_to(DOCS).with_suffix("")
        page = folder / name.with_suffix(".html")
        spelled = re.sub(r'<math[^>]* alttext="([^"]*)">', r"\1 ", page.read_text(encoding="utf-8"))
        shown = html.unescape(re.sub(r"<[^>]+>", "", spelled))
        said = CODE.sub(" ", source.read_text(encoding="utf-8"))
        lost = sorted({word for word in re.findall(r"[A-Za-z]{4,}", said) if word not in shown})
        if lost:
            found.append(f"{name}: the page is without {', '.join(lost[:9])}")
    for page in sorted(folder.rglob("*.html")):
        if re.search(r'<ol class="(upper|lower)', page.read_text(encoding="utf-8")):
            found.append(f"{page.relative_to(folder)}: a list by letters, or the initials of a name")
    return found


if __name__ == "__main__":
    lines = faults(Path(sys.argv[1]))
    print(*lines, sep="\n", end="\n" if lines else "")
    sys.exit(1 if lines else 0)
