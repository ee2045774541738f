"""CSV tables of cases: results as text, and measurements read from a file."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from tisim.errors import InputError, Words, must
from tisim.files import regular_file


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV; the first is the heading."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    return text.getvalue()


def read_table(path: Path, *headings: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Return the heading of a CSV file, which must be one of ``headings``, and its lines of three cells each.

    InputError if it is not such a file.
    """
    other = regular_file.irregular(path)
    must(other is None, str(path), "a CSV file that can be read", Words(other or ""))
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} must be a CSV file that can be read; received {error}") from None
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    must(
        bool(rows) and rows[0] in headings,
        f"heading of {path}",
        " or ".join(",".join(heading) for heading in headings),
        ",".join(*rows[:1] or [[]]),
    )
    for row in rows[1:]:
        must(len(row) == len(rows[0]), f"a line of {path}", "of three cells", ",".join(row))
    return rows[0], rows[1:]
