# SPDX-License-Identifier: Apache-2.0
"""Finds places of a C++ file where a change gives another behaviour. Works on the tokens, without the grammar."""
import re
from dataclasses import dataclass, field

TOKEN = re.compile(
    r"""
    (?P<space>\s+)
  | (?P<comment>//(?:\\.|[^\n\\])*|/\*.*?\*/)
  | (?P<directive>(?<![^\n])\#(?:\\.|[^\n\\])*)
  | (?P<string>(?:u8|[uUL])?R"(?P<end>[^()\s\\]{0,16})\(.*?\)(?P=end)"|(?:u8|[uUL])?"(?:\\.|[^"\\\n])*")
  | (?P<number>\.?\d(?:[eEpP][+-]|'(?=\w)|[\w.])*)
  | (?P<character>'(?:\\.|[^'\\\n])+')
  | (?P<word>[A-Za-z_]\w*)
  | (?P<sign><=>|->|\+\+|--|<<=|>>=|<<|>>|<=|>=|==|!=|&&|\|\||\+=|-=|\*=|/=|%=|&=|\|=|\^=|::|\.\.\.|.)
""",
    re.X | re.S,
)

OPERATORS = {
    "+": ["-"],
    "-": ["+"],
    "*": ["/"],
    "/": ["*"],
    "+=": ["-="],
    "-=": ["+="],
    "*=": ["/="],
    "/=": ["*="],
    "<": ["<=", ">="],
    "<=": ["<", ">"],
    ">": [">=", "<="],
    ">=": [">", "<"],
    "==": ["!="],
    "!=": ["=="],
    "&&": ["||"],
    "||": ["&&"],
}
CLOSING = {"(": ")", "[": "]", "{": "}"}
ASSIGNMENTS = {"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "++", "--"}
NOT_AN_OPERAND = {"return", "case", "else", "co_return", "throw", "in"}
NO_EXPRESSION = set(
    """return using typedef delete static_assert goto case default if for while do switch else try catch namespace
    struct class enum template public private protected operator friend MARROW_PLUGIN""".split()
)


@dataclass
class Token:
    kind: str
    text: str
    start: int
    spaced: bool = False  # white space before it
    partner: int = -1  # of a bracket: the index of the matching bracket

    @property
    def end(self):
        return self.start + len(self.text)


@dataclass
class Place:
    """A place text[start:end] with its possible replacements."""

    path: str
    line: int
    column: int
    start: int
    end: int
    old: str
    choices: list = field(default_factory=list)


def tokens_of(text):
    """The tokens of the compiler, without preprocessor directives."""
    tokens, spaced = [], True
    for match in TOKEN.finditer(text):
        if match.lastgroup in ("space", "comment", "directive"):
            spaced = True
            continue
        kind = "string" if match.lastgroup == "end" else match.lastgroup
        tokens.append(Token(kind, match.group(), match.start(), spaced))
        spaced = False
    stack = []
    for i, token in enumerate(tokens):
        if token.kind != "sign":
            continue
        if token.text in CLOSING:
            stack.append(i)
        elif stack and token.text == CLOSING[tokens[stack[-1]].text]:
            token.partner = stack.pop()
            tokens[token.partner].partner = i
    return tokens


def end_of_statement(tokens, i):
    """The index of the semicolon that ends the statement at i; -1 if a bracket closes or the text ends first."""
    while i < len(tokens):
        text = tokens[i].text
        if tokens[i].kind == "sign" and text == ";":
            return i
        if tokens[i].kind == "sign" and text in CLOSING:
            i = tokens[i].partner
            if i < 0:
                return -1
        elif tokens[i].kind == "sign" and text in ")]}":
            return -1
        i += 1
    return -1


def silent_tokens(tokens):
    """Indices of tokens whose change would not change the behaviour or would not compile: messages, static_assert,
    sizes of types and of text buffers, reserve()."""
    silent = set()
    for i, token in enumerate(tokens):
        following = tokens[i + 1].text if i + 1 < len(tokens) else ""
        if token.text in ("static_assert", "reserve", "alignas") and following == "(":
            silent.update(range(i, tokens[i + 1].partner + 1))
        elif token.text == "throw":
            silent.update(range(i + 1, end_of_statement(tokens, i) + 1))
        elif token.text == "char" and i + 3 < len(tokens) and tokens[i + 2].text == "[":
            silent.update(range(i, tokens[i + 2].partner + 1))
        elif token.text == "<" and not token.spaced and i and tokens[i - 1].kind == "word":
            silent.update(range(i, end_of_template(tokens, i) + 1))
    return silent


def end_of_template(tokens, i):
    """The index of the bracket that closes the template arguments starting at i; -1 if these are not template
    arguments."""
    depth = 0
    while i < len(tokens):
        token = tokens[i]
        if token.text in ("<", ">", ">>"):
            depth += {"<": 1, ">": -1, ">>": -2}[token.text]
            if depth <= 0:
                return i
        elif token.text == "(":
            i = token.partner
        elif token.kind == "sign" and token.text not in ("::", ",", "*", "&", "&&", "...", "-", "+"):
            return -1
        i += 1
    return -1


def in_registration(tokens):
    """Indices of the tokens that register nodes. Only numbers are changed there, because the rest is text."""
    inside = set()
    for i, token in enumerate(tokens):
        if token.text == "MARROW_PLUGIN" and i + 1 < len(tokens) and tokens[i + 1].text == "(":
            body = tokens[i + 1].partner + 1
            if body < len(tokens) and tokens[body].text == "{":
                inside.update(range(i, tokens[body].partner + 1))
    return inside


def changed_number(text):
    """Numbers to write instead: one more or less for integers, twice or half for others, and 1000 times more or less
    for numbers with an exponent."""
    match = re.fullmatch(r"(0[xX][0-9a-fA-F']+|[0-9.']+(?:[eE][+-]?\d+)?)([a-zA-Z]*)", text)
    if not match:
        return []
    digits, suffix = match.group(1).replace("'", ""), match.group(2)
    if digits.lower().startswith("0x"):
        return [hex(int(digits, 16) + 1) + suffix]
    if re.fullmatch(r"\d+", digits) and "f" not in suffix.lower():
        if len(digits) > 1 and digits[0] == "0":
            return []
        return [str(value) + suffix for value in (int(digits) + 1, int(digits) - 1) if value >= 0]
    value, factor = float(digits), 1000 if "e" in digits.lower() else 2
    others = (value * factor, value / factor) if value else (1.0,)
    return [repr(float("%.12g" % other)) + suffix for other in others]


def holds_code(tokens, i):
    """Whether the brace at i opens a block of statements, and not a type, a namespace or a list of values."""
    if not i:
        return False
    before = tokens[i - 1]
    if before.text in (")", "]", ";", "{", "}", "else", "do", "try", "const", "noexcept", "override", "mutable"):
        if before.text not in ("const", ")", "]"):
            return True
        return (
            before.text != "]"
            or tokens[before.partner - 1].text in ("(", ",", "=", "return")
            or tokens[before.partner - 1].kind != "word"
        )
    return any(
        token.text == "->" and tokens[i - back - 1].text == ")"
        for back, token in ((b, tokens[i - b]) for b in range(1, min(i, 9)))
    )


def is_expression(tokens, i, end):
    """Whether the statement does something and is not a declaration."""
    first = tokens[i]
    if first.text in ("break", "continue", "throw"):
        return True
    if first.text in NO_EXPRESSION:
        return False
    if first.text in ("*", "++", "--", "("):
        return True
    if first.kind != "word":
        return False
    i += 1
    while i + 1 < end and tokens[i].text == "::":
        i += 2
    return tokens[i].text in ("(", ".", "->", "[", "<<") or tokens[i].text in ASSIGNMENTS


class Finder:
    def __init__(self, path, text):
        self.path, self.text, self.tokens = path, text, tokens_of(text)
        self.silent, self.registration = silent_tokens(self.tokens), in_registration(self.tokens)
        self.places = []

    def add(self, start, end, choices):
        line = self.text.count("\n", 0, start) + 1
        column = start - self.text.rfind("\n", 0, start)
        self.places.append(Place(self.path, line, column, start, end, self.text[start:end], choices))

    def find(self):
        for i, token in enumerate(self.tokens):
            if i in self.silent:
                continue
            if token.kind == "number":
                choices = changed_number(token.text)
                if choices:
                    self.add(token.start, token.end, choices)
            elif i not in self.registration:
                self.operator(i)
                self.condition(i)
                if token.text == "{" and token.partner > i and holds_code(self.tokens, i):
                    self.statements(i)
        self.places.sort(key=lambda place: (place.start, place.end))
        return self.places

    def operator(self, i):
        token = self.tokens[i]
        if token.kind != "sign" or not i or i + 1 >= len(self.tokens):
            return
        before, after = self.tokens[i - 1], self.tokens[i + 1]
        operand = (
            before.kind in ("word", "number", "character")
            and before.text not in NOT_AN_OPERAND
            or before.text in (")", "]", "}")
        )
        if (
            token.text in OPERATORS
            and operand
            and token.spaced
            and after.spaced
            and "string" not in (before.kind, after.kind)
        ):
            self.add(token.start, token.end, OPERATORS[token.text])
        elif token.text in ("-", "!") and not operand and not after.spaced and before.text != "operator":
            self.add(token.start, token.end, [""])

    def condition(self, i):
        token = self.tokens[i]
        if token.text not in ("if", "while", "for") or i + 1 >= len(self.tokens) or self.tokens[i + 1].text != "(":
            return
        first, last = i + 2, self.tokens[i + 1].partner
        # if (x = ...; condition), for (...; condition; ...)
        while (semicolon := end_of_statement(self.tokens[:last], first)) >= 0:
            if token.text == "for" and any(t.text == ";" for t in self.tokens[i + 2 : first]):
                last = semicolon
                break
            first = semicolon + 1
        else:
            if token.text == "for":
                return  # over a range
        if first >= last or any(t.text == "=" for t in self.tokens[first:last]):
            return
        self.add(
            self.tokens[first].start, self.tokens[last - 1].end, ["true", "false"] if token.text == "if" else ["false"]
        )

    def statements(self, opening):
        """Adds the single statements of a block, also those after an if, for or while without braces."""
        i, closing = opening + 1, self.tokens[opening].partner
        while i < closing:
            text = self.tokens[i].text
            if text in ("if", "for", "while", "switch", "catch"):
                while self.tokens[i].text != "(":
                    i += 1
                i = self.tokens[i].partner + 1
            elif text in ("else", "do", "try"):
                i += 1
            elif text == "{":
                i = self.tokens[i].partner + 1
            else:
                end = end_of_statement(self.tokens[:closing], i)
                if end < 0:
                    return
                if (
                    end > i
                    and is_expression(self.tokens, i, end)
                    and not any(t.text == "reserve" for t in self.tokens[i:end])
                ):
                    lines = self.text.count("\n", self.tokens[i].start, self.tokens[end].start)
                    self.add(self.tokens[i].start, self.tokens[end].start, ["\n" * lines])
                i = end + 1


def places_of(path, text):
    """All places of a file, in order."""
    return Finder(path, text).find()
