"""Mutants of a Python file: each differs from it in one small place.

Comparisons, arithmetic, constants, conditions, returned values and ends of ranges are changed, and
statements are taken away (the operators of R. A. DeMillo, R. J. Lipton and F. G. Sayward, Computer
11(4), 1978, 34, as far as Python has them). What tests need not hold is left alone: docstrings,
texts, annotations, decorators, assertions, what an error says, ``__repr__``, imports, and
``strict=`` of ``zip``.

cosmic-ray and mutmut were judged. cosmic-ray has one test command for all mutants of a session,
changes annotations and decorators, and drops neither statements nor returned values; mutmut puts
all mutants of a function behind a switch, which numba does not compile.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from types import CodeType

RELATIONS: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">=")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<=")),
    ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
"""Each with the limit moved, and with its opposite."""
ARITHMETIC: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
}
SIGNS: dict[type[ast.unaryop], str] = {ast.USub: "-", ast.Not: "not", ast.Invert: "~"}
RETURNS = {"bool": "not ({})", "str": '""'} | dict.fromkeys(("float", "int", "Array"), "-({})")
"""What is returned in the place of a value of such an annotation; None where that is allowed, and
elsewhere no other value of the type is at hand."""
NO_MATTER = ("strict", "repr")
"""Keywords whose value only a mistake of the caller would show, or a record as text."""


@dataclass(frozen=True)
class Mutant:
    """One change of a file. The first five fields name it, also when other lines have changed."""

    module: str
    """Path of the file below the root, with slashes."""
    function: str
    """Where the change is, such as "Flow.run"; "" outside functions and classes."""
    text: str
    """The line that is changed (its first one), without indentation."""
    operator: str
    """What is done to it, such as "< to <="."""
    number: int
    """Which of those that are equal so far, from 0."""
    line: int
    """Of the file as it is, from 1."""
    first: int
    """First line of the statement, or of its head where it has a body."""
    last: int
    """Last line of it."""
    begin: int
    """First byte that is replaced."""
    end: int
    """First byte after."""
    new: str
    """What stands in their place."""

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        return (self.module, self.function, self.text, self.operator, self.number)

    def rank(self, seed: int) -> str:
        """Mutants with the least are a random sample, of which another change of the file takes
        none away."""
        return hashlib.sha256(repr((seed, self.key)).encode()).hexdigest()

    def of(self, source: bytes) -> bytes:
        """The changed file."""
        return source[: self.begin] + self.new.encode() + source[self.end :]

    def diff(self, source: bytes) -> tuple[str, str]:
        """The lines before and after, without what is equal around them."""
        start = source.rfind(b"\n", 0, self.begin) + 1
        stop = source.find(b"\n", self.end)
        stop = len(source) if stop < 0 else stop
        before = source[start:stop]
        after = source[start : self.begin] + self.new.encode() + source[self.end : stop]
        return before.decode().strip(), after.decode().strip()


def mutants(module: str, source: bytes) -> list[Mutant]:
    """All mutants of a file, in the order of its text; some may be the same program as the file, or
    none at all."""
    finder = _Finder(module, source)
    finder.visit(ast.parse(source))
    found, times = [], Counter[tuple[str, str, str]]()
    for mutant in sorted(finder.found, key=lambda m: (m.begin, m.end, m.operator)):
        same = (mutant.function, mutant.text, mutant.operator)
        found.append(replace(mutant, number=times[same]))
        times[same] += 1
    return found


def differs(mutant: Mutant, source: bytes) -> bool:
    """Whether the mutant is a program, and another one than the file."""
    try:
        code = compile(mutant.of(source), mutant.module, "exec", dont_inherit=True)
    except SyntaxError:  # a sign before what may have none
        return False
    return not same_program(compile(source, mutant.module, "exec", dont_inherit=True), code)


def same_program(a: CodeType, b: CodeType) -> bool:
    """Whether two programs are equal instruction by instruction, wherever their lines stand."""
    parts = ("co_code", "co_names", "co_varnames", "co_freevars", "co_cellvars", "co_flags",
             "co_argcount", "co_kwonlyargcount", "co_exceptiontable")  # fmt: skip
    if any(getattr(a, part) != getattr(b, part) for part in parts):
        return False
    if len(a.co_consts) != len(b.co_consts):
        return False
    return all(
        same_program(x, y)
        if isinstance(x, CodeType) and isinstance(y, CodeType)
        else repr(x) == repr(y)  # 0.0 is not -0.0, nor 1 True
        for x, y in zip(a.co_consts, b.co_consts, strict=True)
    )


class _Finder(ast.NodeVisitor):
    """Walks through a file and notes its mutants."""

    def __init__(self, module: str, source: bytes) -> None:
        self.module = module
        self.source = source
        self.found: list[Mutant] = []
        self._names: list[str] = []
        self._lines = source.split(b"\n")
        self._starts = [0]
        for line in self._lines:
            self._starts.append(self._starts[-1] + len(line) + 1)
        self._statement = (1, 1)
        self._returns = ""
        self._bound: set[str] = set()

    # -- noting ------------------------------------------------------------------------------

    def _begin(self, node: ast.expr | ast.stmt) -> int:
        return self._starts[node.lineno - 1] + node.col_offset

    def _end(self, node: ast.expr | ast.stmt) -> int:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._starts[node.end_lineno - 1] + node.end_col_offset

    def _text(self, node: ast.expr) -> str:
        return self.source[self._begin(node) : self._end(node)].decode()

    def _note(self, operator: str, begin: int, end: int, new: str) -> None:
        line = self.source.count(b"\n", 0, begin) + 1
        text = self._lines[line - 1].decode().strip()
        names = ".".join(self._names)
        self.found.append(
            Mutant(
                self.module, names, text, operator, 0, line, *self._statement, begin, end, new
            )
        )  # fmt: skip

    def _replaced(self, operator: str, node: ast.expr, new: str) -> None:
        self._note(operator, self._begin(node), self._end(node), new)

    def _between(self, begin: int, end: int, old: str, new: str) -> None:
        """Another operator in the place of the one between two expressions: brackets, comments and
        line ends may stand there too."""
        code = re.sub(rb"#[^\n]*", lambda m: b"#" * len(m[0]), self.source[begin:end])
        word = old.isalpha() or " " in old
        pattern = rb"\b%s\b" if word else rb"%s"
        at = re.search(pattern % rb"\s+".join(map(re.escape, old.encode().split())), code)
        if at is not None:
            self._note(f"{old} to {new}".strip(), begin + at.start(), begin + at.end(), new)

    # -- where nothing is changed --------------------------------------------------------------

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        pass

    def visit_Assert(self, node: ast.Assert) -> None:
        pass

    def visit_Raise(self, node: ast.Raise) -> None:
        pass

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._inside(node.name, node.body)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        if node.name == "__repr__":
            return
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.visit(default)
        before = self._returns, self._bound
        self._returns = "" if node.returns is None else ast.unparse(node.returns)
        arguments = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
        self._bound = {argument.arg for argument in arguments}
        self._inside(node.name, node.body)
        self._returns, self._bound = before

    def _inside(self, name: str, body: Sequence[ast.stmt]) -> None:
        self._names.append(name)
        for statement in body:
            self.visit(statement)
        self._names.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)
            self._bound |= _names_in(node.target)

    # -- statements ----------------------------------------------------------------------------

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            last = body[0].lineno - 1 if body else node.end_lineno or node.lineno
            self._statement = (node.lineno, max(last, node.lineno))
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                return
            if self._names and self._may_go(node):
                self._note("statement dropped", self._begin(node), self._end(node), "pass")
        super().visit(node)
        if isinstance(node, (ast.Assign, ast.For)):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                self._bound |= _names_in(target)

    def _may_go(self, node: ast.stmt) -> bool:
        """Whether a statement's absence shows otherwise than by a name that is not there."""
        if isinstance(node, ast.Assign):
            if self._names[-1] == "__init__":
                return False
            new = {n for target in node.targets for n in _names_in(target)}
            return new <= self._bound
        if isinstance(node, ast.Expr):
            return isinstance(node.value, (ast.Call, ast.Yield, ast.YieldFrom))
        return isinstance(node, (ast.AugAssign, ast.Raise, ast.Break, ast.Continue, ast.Delete))

    def visit_Return(self, node: ast.Return) -> None:
        value = node.value
        if value is None:
            return
        new = "None" if self._returns.endswith("| None") else RETURNS.get(self._returns, "")
        if new:
            self._replaced(f"return {new.format('…')}", value, new.format(self._text(value)))
        self.visit(value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        known = ARITHMETIC.get(type(node.op))
        if known is not None:
            old, new = (f"{sign}=" for sign in known)
            self._between(self._end(node.target), self._begin(node.value), old, new)
        self.generic_visit(node)

    def visit_If(self, node: ast.If | ast.While | ast.IfExp) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    visit_While = visit_If
    visit_IfExp = visit_If

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for test in node.ifs:
            self._condition(test)
        self.generic_visit(node)

    def _condition(self, test: ast.expr) -> None:
        """The opposite of a condition that has no operator of its own."""
        if isinstance(test, (ast.Name, ast.Attribute, ast.Call, ast.Subscript, ast.NamedExpr)):
            self._replaced("condition negated", test, f"(not ({self._text(test)}))")

    # -- expressions ---------------------------------------------------------------------------

    def visit_Compare(self, node: ast.Compare) -> None:
        sides = [node.left, *node.comparators]
        for left, relation, right in zip(sides[:-1], node.ops, sides[1:], strict=True):
            old, others = RELATIONS[type(relation)]
            for new in others:
                self._between(self._end(left), self._begin(right), old, new)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        known = ARITHMETIC.get(type(node.op))
        types = isinstance(node.op, ast.BitOr) and not self._names  # an alias of types
        text = isinstance(node.left, (ast.Constant, ast.JoinedStr)) and not _number(node.left)
        if known is not None and not types and not text:
            self._between(self._end(node.left), self._begin(node.right), *known)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values[:-1], node.values[1:], strict=True):
            self._between(self._end(left), self._begin(right), old, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        old = SIGNS.get(type(node.op))
        if old is not None:
            self._between(self._begin(node), self._begin(node.operand), old, "")
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            self._number(node.operand, signed=True)
        else:
            self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self._replaced(f"{node.value} to {not node.value}", node, str(not node.value))
        else:
            self._number(node, signed=False)

    def _number(self, node: ast.Constant, *, signed: bool) -> None:
        if not _number(node):
            return
        text, more = self._text(node), repr(node.value + 1)  # type: ignore[operator]
        self._replaced(f"{text} to {more}", node, more)
        if not signed and node.value and isinstance(node.value, float):
            self._replaced(f"{text} to -{text}", node, f"(-{text})")

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name == "cast" or name.endswith(("Error", "Warning")):
            return
        self.visit(node.func)
        for argument in node.args:
            self.visit(argument)
        for keyword in node.keywords:
            if keyword.arg not in NO_MATTER:
                self.visit(keyword.value)
        if name == "range":
            end = node.args[0] if len(node.args) == 1 else node.args[1]
            self._shifted("end of a range", end)

    def visit_Slice(self, node: ast.Slice) -> None:
        for bound in (node.lower, node.upper):
            if bound is not None:
                self._shifted("limit of a slice", bound, (1,))
        self.generic_visit(node)

    def _shifted(self, what: str, node: ast.expr, by: Sequence[int] = (1, -1)) -> None:
        """What is no constant: one more and one less."""
        if not isinstance(node, ast.Constant):
            for step in by:
                sign = "+" if step > 0 else "-"
                self._replaced(f"{what} {step:+d}", node, f"({self._text(node)} {sign} 1)")


def _number(node: ast.expr) -> bool:
    """Whether it is a number, and no truth value."""
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _names_in(target: ast.expr) -> set[str]:
    """Names that an assignment binds; of an element or an attribute none, which is there before."""
    if isinstance(target, ast.Name):
        return {target.id}
    if isinstance(target, (ast.Tuple, ast.List)):
        return {name for element in target.elts for name in _names_in(element)}
    if isinstance(target, ast.Starred):
        return _names_in(target.value)
    return set()


def in_turn(lists: Sequence[Iterable[Mutant]]) -> Iterator[Mutant]:
    """One of each, again and again, until all are through."""
    for turn in zip_longest(*lists):
        yield from (mutant for mutant in turn if mutant is not None)


def shuffled(found: Iterable[Mutant], seed: int) -> list[Mutant]:
    """In a random order of this seed."""
    return sorted(found, key=lambda mutant: mutant.rank(seed))
