"""LLVM code of the terms in a loop's Python: whole numbers, real numbers, truths and C-contiguous arrays.

What a loop around a graph's operations needs, and nothing more; what is not known here is an error when the loop is
compiled. A name keeps the kind of the first value that it gets. Indices are not checked, and none counts from the end.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from llvmlite import ir

WHOLE, REAL, TRUTH = ir.IntType(64), ir.DoubleType(), ir.IntType(1)
_KINDS = {"d": REAL, "l": WHOLE}
_DATA, _SHAPE = 16, 32
"""Where NumPy's `PyArrayObject_fields` has address and dimensions [bytes], which is part of its binary interface."""


class LoopError(TypeError):
    """A loop has something in it that is not known here."""


@dataclass(frozen=True)
class View:
    """An array, or a part of one that is as contiguous."""

    data: Any  # pointer to its first element
    kind: Any
    shape: tuple[Any, ...]  # dimensions, whole numbers of LLVM


def whole(value: int) -> Any:
    """A constant whole number."""
    return ir.Constant(WHOLE, value)


class Terms:
    """Emits terms where a builder stands.

    Attributes:
        variables: place of each name that has one number.
        arrays: each name that has an array.
        words: how much of the workspace is used [8 bytes].
        around: of each loop around here: where it goes on, and where it ends.
    """

    def __init__(self, builder: Any, entry: Any, constants: Mapping[str, object], workspace: Any) -> None:
        self.b, self._entry, self._constants, self._workspace = builder, entry, constants, workspace
        self.variables: dict[str, Any] = {}
        self.arrays: dict[str, View] = {}
        self.words = 0
        self.around: list[tuple[Any, Any]] = []

    def argument(self, name: str, address: Any, code: str, dimensions: int) -> None:
        """Take an argument: a number, or the address of one of NumPy's arrays of a type and number of dimensions."""
        if not dimensions:
            self.store(name, address)
            return
        kind = _KINDS[code]
        data = self.b.inttoptr(self._word(address, _DATA), kind.as_pointer())
        shape = self._word(address, _SHAPE)
        self.arrays[name] = View(data, kind, tuple(self._word(shape, 8 * k) for k in range(dimensions)))

    def _word(self, address: Any, offset: int) -> Any:
        return self.b.load(self.b.inttoptr(self.b.add(address, whole(offset)), WHOLE.as_pointer()), typ=WHOLE)

    def store(self, name: str, value: Any) -> None:
        """Give a name its value."""
        if isinstance(value, View):
            self.arrays[name] = value
            return
        if name not in self.variables:
            self.variables[name] = self._entry.alloca(value.type)
        place = self.variables[name]
        self.b.store(self.as_kind(value, place.allocated_type), place)

    @contextmanager
    def named(self, values: Mapping[str, Any]) -> Iterator[None]:
        """These names alone, and those that get a value inside."""
        before = self.variables, self.arrays, self.around
        self.variables, self.arrays, self.around = {}, {}, []
        for name, value in values.items():
            self.store(name, value)
        yield
        self.variables, self.arrays, self.around = before

    def as_kind(self, value: Any, kind: Any) -> Any:
        """A number as one of a kind; a real number becomes whole by `int` alone."""
        if value.type == kind:
            return value
        if kind == REAL and value.type == WHOLE:
            return self.b.sitofp(value, REAL)
        raise LoopError(f"{value.type} where {kind} is wanted")

    def __call__(self, node: ast.expr) -> Any:
        """The value of a term: a number of LLVM, a view, or a tuple of them."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise LoopError(f"not known in a loop: {ast.unparse(node)}")
        return method(node)

    def _constant(self, node: ast.Constant) -> Any:
        return self._number(node.value)

    def _number(self, value: Any) -> Any:
        if isinstance(value, bool):
            return ir.Constant(TRUTH, int(value))
        if isinstance(value, int):
            return whole(value)
        if isinstance(value, float):
            return ir.Constant(REAL, value)
        raise LoopError(f"not a number in a loop: {value!r}")

    def _name(self, node: ast.Name) -> Any:
        if node.id in self.arrays:
            return self.arrays[node.id]
        if node.id in self.variables:
            place = self.variables[node.id]
            return self.b.load(place, typ=place.allocated_type)
        return self._number(self._constants.get(node.id, node.id))

    def _tuple(self, node: ast.Tuple) -> Any:
        return tuple(self(element) for element in node.elts)

    def _attribute(self, node: ast.Attribute) -> Any:
        if node.attr == "inf":
            return self._number(math.inf)
        if node.attr != "shape":
            raise LoopError(f"not known in a loop: {ast.unparse(node)}")
        return self(node.value).shape

    def _subscript(self, node: ast.Subscript) -> Any:
        if isinstance(node.value, ast.Attribute) and isinstance(node.slice, ast.Constant):
            return self(node.value)[node.slice.value]
        found = self.part(node)
        return found if found.shape else self.b.load(found.data, typ=found.kind)

    def part(self, node: ast.Subscript) -> View:
        """An array's part at some indices; the last may be a range that has a beginning alone."""
        array: View = self(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        shape, offset = list(array.shape), whole(0)
        if len(indices) > len(shape):
            raise LoopError(f"not so many dimensions: {ast.unparse(node)}")
        for index in indices:
            length = shape.pop(0)
            if isinstance(index, ast.Slice):
                if index.lower is None or index.upper or index.step or shape or index is not indices[-1]:
                    raise LoopError(f"not known in a loop: {ast.unparse(node)}")
                begin = self(index.lower)
                offset = self.b.add(self.b.mul(offset, length), begin)
                return View(self.element(array.data, array.kind, offset), array.kind, (self.b.sub(length, begin),))
            offset = self.b.add(self.b.mul(offset, length), self(index))
        for length in shape:
            offset = self.b.mul(offset, length)
        return View(self.element(array.data, array.kind, offset), array.kind, tuple(shape))

    def element(self, data: Any, kind: Any, place: Any) -> Any:
        """The pointer to an element."""
        return self.b.gep(data, [place], source_etype=kind)

    def both(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Two numbers of one kind."""
        kind = REAL if REAL in (x.type, y.type) else x.type
        return self.as_kind(x, kind), self.as_kind(y, kind)

    def arithmetic(self, operation: ast.operator, x: Any, y: Any) -> Any:
        """A sum, difference, product or quotient; a quotient is always a real number."""
        if isinstance(operation, ast.Div):
            return self.b.fdiv(self.as_kind(x, REAL), self.as_kind(y, REAL))
        x, y = self.both(x, y)
        names = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
        if type(operation) not in names:
            raise LoopError(f"not known in a loop: {type(operation).__name__}")
        name = names[type(operation)]
        return getattr(self.b, f"f{name}" if x.type == REAL else name)(x, y)

    def _binop(self, node: ast.BinOp) -> Any:
        return self.arithmetic(node.op, self(node.left), self(node.right))

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        value = self(node.operand)
        if isinstance(node.op, ast.USub):
            return self.b.fneg(value) if value.type == REAL else self.b.neg(value)
        if isinstance(node.op, ast.Not):
            return self.b.not_(value)
        raise LoopError(f"not known in a loop: {ast.unparse(node)}")

    def _compare(self, node: ast.Compare) -> Any:
        symbols = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
        if len(node.ops) != 1 or type(node.ops[0]) not in symbols:
            raise LoopError(f"not known in a loop: {ast.unparse(node)}")
        return self._compared(symbols[type(node.ops[0])], self(node.left), self(node.comparators[0]))

    def _compared(self, symbol: str, x: Any, y: Any) -> Any:
        x, y = self.both(x, y)
        if x.type == WHOLE:
            return self.b.icmp_signed(symbol, x, y)
        return self.b.fcmp_unordered(symbol, x, y) if symbol == "!=" else self.b.fcmp_ordered(symbol, x, y)

    def _boolop(self, node: ast.BoolOp) -> Any:
        """What stands behind is looked at only where it decides."""
        place = self._entry.alloca(TRUTH)
        self.b.store(self(node.values[0]), place)
        for term in node.values[1:]:
            known = self.b.load(place, typ=TRUTH)
            open_still = known if isinstance(node.op, ast.And) else self.b.not_(known)
            with self.b.if_then(open_still):
                self.b.store(self(term), place)
        return self.b.load(place, typ=TRUTH)

    def _ifexp(self, node: ast.IfExp) -> Any:
        ends: list[tuple[Any, Any]] = []
        with self.b.if_else(self(node.test)) as cases:
            for block, term in zip(cases, (node.body, node.orelse), strict=True):
                with block:
                    value = self(term)
                    ends.append((value, self.b.block))
        chosen = self.b.phi(ends[0][0].type)
        for value, end in ends:
            chosen.add_incoming(self.as_kind(value, chosen.type), end)
        return chosen

    def _call(self, node: ast.Call) -> Any:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
        known: dict[str, Callable[..., Any]] = {
            "max": lambda x, y: self._larger(">", x, y), "min": lambda x, y: self._larger("<", x, y),
            "abs": self._magnitude, "isfinite": self._finite, "int": lambda x: self.b.fptosi(x, WHOLE),
            "len": lambda x: x.shape[0],
        }  # fmt: skip
        if name in ("empty", "zeros", "ones", "full"):
            return self._made(name, node.args)
        if name not in known:
            raise LoopError(f"not known in a loop: {ast.unparse(node)}")
        return known[name](*map(self, node.args))

    def _larger(self, symbol: str, x: Any, y: Any) -> Any:
        """As Python's max and min: the first unless the second is more so."""
        x, y = self.both(x, y)
        return self.b.select(self._compared(symbol, y, x), y, x)

    def _magnitude(self, x: Any) -> Any:
        module = self.b.module
        function = module.globals.get("llvm.fabs.f64") or ir.Function(
            module, ir.FunctionType(REAL, [REAL]), "llvm.fabs.f64"
        )
        return self.b.call(function, [x])

    def _finite(self, x: Any) -> Any:
        return self.b.fcmp_ordered("<", self._magnitude(x), self._number(math.inf))

    def _made(self, name: str, arguments: list[ast.expr]) -> View:
        """An array in the workspace; its size is known when the loop is compiled."""
        sizes = self(arguments[0])
        shape = sizes if isinstance(sizes, tuple) else (sizes,)
        count = math.prod(length.constant for length in shape)
        rest = arguments[1:]
        value = self(rest.pop(0)) if name == "full" else self._number(1.0 if name == "ones" else 0.0)
        if rest and name != "full":
            value = whole(int(value.constant))  # of np.int64, the only type that is named
        begin = self.element(self._workspace, REAL, whole(self.words))
        data = self.b.bitcast(begin, value.type.as_pointer())
        self.words += count
        if name != "empty":
            with self.counting(whole(0), whole(count)) as k:
                self.b.store(value, self.element(data, value.type, k))
        return View(data, value.type, tuple(shape))

    @contextmanager
    def counting(self, begin: Any, end: Any, step: Any = None) -> Iterator[Any]:
        """A counting loop around what is emitted inside; gives the count, and leaves the builder behind the loop.

        Where the loop goes on and where it ends are `around[-1]` inside.
        """
        counter = self._entry.alloca(WHOLE)
        self.b.store(begin, counter)
        test, inside, on, after = (self.b.append_basic_block(at) for at in ("test", "inside", "on", "after"))
        self.b.branch(test)
        self.b.position_at_end(test)
        k = self.b.load(counter, typ=WHOLE)
        self.b.cbranch(self.b.icmp_signed("<", k, end), inside, after)
        self.b.position_at_end(inside)
        self.around.append((on, after))
        yield k
        self.around.pop()
        if not self.b.block.is_terminated:
            self.b.branch(on)
        self.b.position_at_end(on)
        self.b.store(self.b.add(k, step or whole(1)), counter)
        self.b.branch(test)
        self.b.position_at_end(after)
