"""Puts the table of a run of the hard cases into docs/hard_cases.md.

tisim hard --all --out DIR && python docs/hard_table.py DIR

A run of some families, such as ``tisim hard packings filters --out DIR``, replaces their sections alone; each
then says which run it is of.
"""

import re
import sys
from pathlib import Path

BEGIN, END = "<!-- the table of tisim hard --all -->\n", "<!-- its end -->\n"
PAGE = Path(__file__).with_name("hard_cases.md")


def parts(text: str) -> tuple[str, str, str]:
    """The page before its table, the table, and the rest."""
    before, table = text.split(BEGIN)
    table, after = table.split(END)
    return before, table.strip(), after


def sections(table: str) -> tuple[str, dict[str, str]]:
    """The line about the run, and the section of each family by its title."""
    about, *families = re.split(r"^### ", table.strip(), flags=re.M)
    return about.strip(), {one.partition("\n")[0]: one.partition("\n")[2].strip() for one in families}


def counted(section: str) -> str:
    """The numbers of cases and of measured numbers of a section."""
    rows = [line for line in section.splitlines() if line.startswith("| ")][1:]
    cases = sum(line.startswith("| **") for line in rows)
    return f"{cases} cases, {len(rows) - cases} numbers"


def joined(old: str, new: str, titles: list[str]) -> str:
    """The table of a page with the sections of a run in place of its own, in the order of the titles."""
    about, found = sections(old)
    of_run, measured = sections(new)
    if list(measured) == titles:
        return new.strip()
    found |= {
        title: f"{counted(section)}, of a run of {of_run}\n\n{section}" for title, section in measured.items()
    }
    return "\n\n".join([about, *(f"### {title}\n\n{found[title]}" for title in titles if title in found)])


if __name__ == "__main__":
    from tisim.cases.hard.hard_case import hard_cases, title

    before, table, after = parts(PAGE.read_text(encoding="utf-8"))
    run = (Path(sys.argv[1]) / "hard_cases.md").read_text(encoding="utf-8")
    whole = joined(table, run, [title(family) for family in hard_cases()])
    PAGE.write_text(f"{before}{BEGIN}\n{whole}\n\n{END}{after}", encoding="utf-8")
