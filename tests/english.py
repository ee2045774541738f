"""Count the turns of phrase over which readers stumble, in 1,000 words of prose.

    python tests/english.py [FILE OR FOLDER ...]    each file with any of them, worst first; without: rooms

Prose is the docstrings and comments of Python files, and the text of Markdown pages outside code. Four turns
are counted: "what" in place of a noun (except in questions), "where" in place of "if" or "when", "so many"
and "so much" in place of a number, and "that of" and "those of" in place of the noun.
"""

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from pathlib import Path

TURNS = {
    "what": re.compile(r"\bwhat(?:ever)?\b", re.IGNORECASE),
    "where": re.compile(r"\bwhere\b", re.IGNORECASE),
    "so many": re.compile(r"\b(?:so|as) (?:many|much)\b", re.IGNORECASE),
    "that of": re.compile(r"\b(?:that|those) of\b", re.IGNORECASE),
}
QUESTION = re.compile(r"[^.!?\n]*\?")
CODE = re.compile(r"(?s:```.*?```)|``[^`]*``|`[^`\n]*`|^(?: {4}|\t)[^\n]*$", re.MULTILINE)


def prose(file: Path) -> str:
    """The prose of a file."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".md":
        return QUESTION.sub("", CODE.sub("", text))
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    parts = [ast.get_docstring(node) or "" for node in ast.walk(ast.parse(text)) if isinstance(node, kinds)]
    for node in ast.walk(ast.parse(text)):  # texts below constants and attributes
        body = getattr(node, "body", None)
        for one in body[1:] if isinstance(body, list) else ():
            if (
                isinstance(one, ast.Expr)
                and isinstance(one.value, ast.Constant)
                and isinstance(one.value.value, str)
            ):
                parts.append(one.value.value)
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            parts.append(token.string.lstrip("# "))
    return QUESTION.sub("", CODE.sub("", "\n\n".join(parts)))


def counted(files: list[Path]) -> tuple[int, Counter[str]]:
    """The number of words of files, and of each turn of phrase."""
    words, turns = 0, Counter[str]()
    for file in files:
        text = prose(file)
        words += len(text.split())
        turns.update({name: len(pattern.findall(text)) for name, pattern in TURNS.items()})
    return words, turns


def line(name: str, words: int, turns: Counter[str]) -> str:
    rates = "  ".join(f"{turn} {1000 * turns[turn] / max(words, 1):5.2f}" for turn in TURNS)
    return f"{name:44s} {words:6d} words  {rates}"


def readable(folder: Path) -> list[Path]:
    return sorted(file for end in ("py", "md") for file in folder.rglob(f"*.{end}"))


def main() -> None:
    root = Path(__file__).parents[1]
    print("in 1,000 words:")
    if len(sys.argv) > 1:
        given = [Path(name) for name in sys.argv[1:]]
        files = [file for one in given for file in (readable(one) if one.is_dir() else [one])]
        found = [(sum(counted([file])[1].values()), file) for file in files]
        for number, file in sorted(found, reverse=True):
            if number:
                print(line(file.as_posix(), *counted([file])))
        print(line("all", *counted(files)))
        return
    rooms = sorted(
        one for name in ("tisim", "optimize", "cases") for one in (root / name).iterdir() if one.is_dir()
    )
    for room in (*rooms, root / "docs", root / "tests"):
        if room.name != "__pycache__":
            print(line(room.relative_to(root).as_posix(), *counted(readable(room))))
    print(line("README.md", *counted([root / "README.md"])))
    whole = [file for name in ("tisim", "optimize", "cases") for file in readable(root / name)]
    print(line("tisim, optimize, cases", *counted(whole)))


if __name__ == "__main__":
    main()
