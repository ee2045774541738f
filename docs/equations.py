"""Plain-text equations, as docstrings have them, become MathML.

Notation: a space multiplies. A `/` without spaces divides what it touches, so `dt/2m F` is (dt/(2m)) F. A `/`
with spaces divides all factors since the last fraction, sum or word by the next factor, so `2 pi R / (4 d) n`
is ((2 pi R)/(4 d)) n. `F_i`, `r^2`, `d^-beta_1`, `R*` and `v'` have scripts. `m.n` and ` . ` are scalar
products, ` x ` a vector product, `(x)` a dyadic product, ` * ` a product. `|v|` is an absolute value, `<R>` a
mean. Greek letters and functions go by their names, `dt` is a differential, and all other words are text.
Anything else raises ``Unset``, so that no equation is set wrongly.
"""

from __future__ import annotations

from html import escape

from mathml import (
    CLOSING,
    FUNCTIONS,
    JOINING,
    LARGE,
    Part,
    Token,
    Unset,
    fenced,
    fraction,
    joined,
    number,
    operator,
    script,
    scripted,
    space,
    symbol,
    tag,
    tokens,
    words,
)

OPERAND = ("name", "number", "word")


def mathml(text: str) -> str:
    """Return an equation, or some with commas between them, as a ``math`` element."""
    return f'<math displaystyle="true" alttext="{escape(" ".join(text.split()))}">{content(text)}</math>'


def inline(text: str) -> str:
    """Return a formula of a sentence as a ``math`` element, with its fractions on one line."""
    return f'<math alttext="{escape(" ".join(text.split()))}">{content(text, flat=True)}</math>'


def content(text: str, flat: bool = False) -> str:
    """Return an equation as MathML, without the ``math`` element around it."""
    parser = Parser(text, flat)
    result = parser.items()
    if parser.next.kind != "end":
        raise Unset(f"{parser.next.text} in {text}")
    return result


class Parser:
    """Reads an equation, with a method for each level of precedence. flat : fractions are on one line."""

    def __init__(self, text: str, flat: bool = False) -> None:
        self.tokens, self.at, self.flat = tokens(text), 0, flat

    @property
    def next(self) -> Token:
        return self.tokens[self.at]

    @property
    def second(self) -> Token:
        return self.tokens[self.at + 1]

    def take(self, expected: str = "") -> str:
        """Return the next token's text, which must be the expected one."""
        text = self.next.text
        if self.next.kind == "end" or (expected and text != expected):
            raise Unset(f"{text or 'the end'} in place of {expected or 'more'}")
        self.at += 1
        return text

    def items(self) -> str:
        """Equations with commas between them."""
        parts = [self.equation()]
        while self.next.text in (",", ";"):
            parts.append(operator(self.take(), separator="true", rspace="0.5em"))
            if self.next.kind != "end":
                parts.append(self.equation())
        return tag("mrow", *parts)

    def equation(self) -> str:
        """Sums with relations between them. A line that goes on with an equation begins with a relation."""
        parts = [] if self.next.kind == "relation" and not self.opens() else [self.sum()]
        while self.next.kind == "relation":
            parts += [operator(self.take(), form="infix"), self.sum()]
        return tag("mrow", *parts)

    def sum(self) -> str:
        """Products with + and - between them."""
        parts = [operator(self.take(), form="prefix")] if self.next.text in ("+", "-") else []
        parts.append(self.product())
        while self.next.text in ("+", "-", "+-", "-+"):
            parts += [operator(self.take(), form="infix"), self.product()]
        return tag("mrow", *parts)

    def product(self) -> str:
        """Factors and spaced fractions. start : first factor that a `/` divides."""
        parts, start = [self.tight()], 0
        while True:
            if parts[-1].role in ("large", "joining"):
                start = len(parts)
            if self.next.text == "/":
                self.take()
                if start == len(parts) and parts[-1].role != "fraction":
                    raise Unset("a fraction without a numerator")
                start = min(start, len(parts) - 1)
                under = Part(self.product()) if self.next.text in LARGE else self.tight()
                parts[start:] = [fraction(parts[start:], under, self.flat)]
                start = len(parts)
            elif sign := self.multiplication():
                start += start == len(parts)
                parts += [Part(operator(sign), "operator"), self.tight()]
            elif parts[-1].role in ("text", "joining") and self.next.text == "-" and not self.next.after:
                parts += [Part(operator(self.take(), form="prefix")), self.tight()]
            elif self.begins_factor():
                parts.append(self.tight())
            else:
                return joined(parts)

    def multiplication(self) -> str:
        """Take and return the sign of a product, if one is next."""
        if [one.text for one in self.tokens[self.at : self.at + 3]] == ["(", "x", ")"] and self.next.before:
            self.at += 3
            return "(x)"
        operand = self.second.kind in OPERAND or self.second.text in ("(", "[", "|")
        is_sign = self.next.text in ("x", ".", "*") and self.next.before and self.next.after and operand
        return self.take() if is_sign else ""

    def opens(self) -> bool:
        """Return whether a bar or `<` opens a bracket: it touches the token after it, and not that before."""
        return self.next.text in ("|", "<") and self.next.before and not self.next.after

    def begins_factor(self) -> bool:
        return self.next.kind in OPERAND or self.next.text in ("(", "[") or self.opens()

    def tight(self, signs: tuple[str, ...] = ("/", ".")) -> Part:
        """Factors that touch, such as `2m` and `f(x)`, or have a sign between them, as `m_i.n` and `dt/m`."""
        parts = [self.factor()]
        while not self.next.before:
            if self.next.text in signs and not self.next.after:
                if self.take() == "/":
                    parts = [fraction(parts, self.tight(signs=()), self.flat)]
                    continue
                parts += [Part(operator("."), "operator"), self.factor()]
                if {parts[-1].role, parts[-3].role} & {"text", "joining"}:
                    raise Unset("a name of a program")
            elif self.next.kind in OPERAND or self.next.text in ("(", "["):
                parts.append(self.factor())
            else:
                break
        return parts[0] if len(parts) == 1 else Part(tag("mrow", *(part.mathml for part in parts)))

    def factor(self) -> Part:
        """A number, symbol, function, bracket or run of words, with its scripts."""
        token = self.next
        if token.text in CLOSING:
            return self.bracket()
        self.take()
        if token.kind == "word":
            role = "joining" if JOINING & set(token.text.split()) else "text"
            return self.scripts(words(token.text), role)
        if token.kind == "number":
            return self.scripts(number(token.text))
        if token.kind != "name":
            raise Unset(f"{token.text or 'the end'} in place of a factor")
        if token.text in LARGE:
            return self.scripts(operator(LARGE[token.text]), "large")
        if token.text == "sqrt":
            return self.scripts(tag("msqrt", self.bare_bracket().inner))
        if token.text in FUNCTIONS:
            return self.function(token.text)
        return self.scripts(symbol(token.text), name=True)

    def function(self, name: str) -> Part:
        """A function of a bracket that touches it, or of the factor after a space; alone before words."""
        head = self.scripts(tag("mi", name)).mathml
        if self.next.text == "(" and not self.next.before:
            return Part(tag("mrow", head, self.bracket().mathml), "function")
        if self.next.kind == "word":
            return Part(head, "text")
        return Part(tag("mrow", head, space(0.17), self.factor().mathml), "function")

    def bracket(self) -> Part:
        """A bracket or absolute value, with its scripts."""
        part = self.bare_bracket()
        whole = self.scripts(part.mathml)
        return part if whole.mathml == part.mathml else whole

    def bare_bracket(self) -> Part:
        opening = self.take()
        inner = self.sum() if opening in ("|", "<") else self.items()
        self.take(CLOSING.get(opening, "a bracket"))
        return fenced(opening, inner, self.flat)

    def scripts(self, base: str, role: str = "factor", name: bool = False) -> Part:
        """What touches a factor: an index, an exponent, primes, and of a name also `*`, `+` and `-`."""
        under, above = [], []
        while not self.next.before:
            follows = self.second.kind in OPERAND and not self.next.after
            ends = self.second.kind in ("relation", "end") or self.second.text in (",", ")", "+", "-")
            if self.next.text == "_":
                self.take()
                under += [*([space(0.35)] if under else []), self.index()]
            elif self.next.text == "^":
                self.take()
                above.append(self.exponent())
            elif self.next.text == "'":
                above.append(operator(self.take()))
            elif name and not follows and (self.next.text == "*" or (self.next.text in "+-" and ends)):
                sign = self.take()
                above.append(tag("mo", "*") if sign == "*" else operator(sign))
            else:
                break
        return Part(scripted(base, under, above, role == "large"), role)

    def index(self) -> str:
        """What is after `_`: letters and numbers, or a relation in brackets."""
        if self.next.text == "(":
            return self.bare_bracket().inner
        text = self.take()
        while self.next.kind in OPERAND and not self.next.before:
            text += self.take()
        if not text.isalnum():
            raise Unset(f"{text} in place of an index")
        if set(text) <= set("ijkab"):
            return tag("mrow", *(tag("mi", one) for one in text))
        return number(text) if text.isdecimal() else script(text)

    def exponent(self) -> str:
        """What is after `^`: a number, a symbol with its index, or a bracket, with or without a sign."""
        sign = [operator(self.take(), form="prefix")] if self.next.text == "-" else []
        if self.next.text == "(":
            flat, self.flat = self.flat, True
            inner = self.bare_bracket().inner
            self.flat = flat
            return tag("mrow", *sign, inner)
        token, text = self.next, self.take()
        if token.kind not in OPERAND or text in LARGE:
            raise Unset("an exponent")
        base = number(text) if token.kind == "number" else script(text)
        if self.next.text == "_" and not self.next.before:
            self.take()
            base = tag("msub", base, self.index())
        return tag("mi", "T", mathvariant="normal") if text == "T" else tag("mrow", *sign, base)
