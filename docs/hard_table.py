"""Puts the table of a run of the hard cases into docs/hard_cases.md.

tisim hard --all --out DIR && python docs/hard_table.py DIR
"""

import sys
from pathlib import Path

BEGIN, END = "<!-- the table of tisim hard --all -->\n", "<!-- its end -->\n"
PAGE = Path(__file__).with_name("hard_cases.md")


def parts(text: str) -> tuple[str, str, str]:
    """The page before its table, the table, and the rest."""
    before, table = text.split(BEGIN)
    table, after = table.split(END)
    return before, table.strip(), after


if __name__ == "__main__":
    before, _, after = parts(PAGE.read_text(encoding="utf-8"))
    table = (Path(sys.argv[1]) / "hard_cases.md").read_text(encoding="utf-8")
    PAGE.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}", encoding="utf-8")
