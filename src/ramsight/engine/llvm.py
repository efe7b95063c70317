"""Machine code from a CasADi graph: every elementary operation becomes one LLVM operation on doubles or vectors.

A `Program` (the operations of one SX function) becomes one function of machine code, for one run at a time or for
`width` runs side by side. No compiler is needed on the machine, and the same graph gives both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import casadi as ca
from llvmlite import ir

from ramsight.engine.branches import Branch, schedule
from ramsight.engine.graph import SELECT, Node, Program, graph_of
from ramsight.engine.object_code import JOINED
from ramsight.engine.packing import AT_ONCE, packed
from ramsight.engine.writes import Writes, writes

_LOG2_E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10  # ln 2 in two parts, as in fdlibm
_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding it leaves the nearest integer in the low bits


class _Emitter:
    """Emits operations on one value type into an LLVM builder."""

    def __init__(self, builder: Any, width: int) -> None:
        self.b, self.width = builder, width
        double, integer, bit = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
        self.real = double if width == 1 else ir.VectorType(double, width)
        self.integer = integer if width == 1 else ir.VectorType(integer, width)
        self.bit = bit if width == 1 else ir.VectorType(bit, width)
        self.suffix = "f64" if width == 1 else f"v{width}f64"

    def constant(self, value: float) -> Any:
        return ir.Constant(self.real, float(value) if self.width == 1 else [float(value)] * self.width)

    def whole(self, value: int) -> Any:
        return ir.Constant(self.integer, value if self.width == 1 else [value] * self.width)

    def call(self, name: str, *arguments: Any) -> Any:
        full = f"llvm.{name}.{self.suffix}"
        module = self.b.module
        function = module.globals.get(full)
        if function is None:
            function = ir.Function(module, ir.FunctionType(self.real, [self.real] * len(arguments)), full)
        return self.b.call(function, arguments)

    def fma(self, x: Any, y: Any, z: Any) -> Any:
        return self.call("fma", x, y, z)

    def truth(self, flag: Any) -> Any:
        return self.b.select(flag, self.constant(1.0), self.constant(0.0))

    def compare(self, symbol: str) -> Callable[[Any, Any], Any]:
        return lambda x, y: self.truth(self.b.fcmp_ordered(symbol, x, y))

    def nonzero(self, x: Any) -> Any:
        return self.b.fcmp_unordered("!=", x, self.constant(0.0))

    def negation(self, x: Any) -> Any:
        return self.b.select(self.nonzero(x), self.constant(0.0), self.constant(1.0))

    def chosen(self, condition: Any, x: Any, y: Any = None) -> Any:
        """One of two values, or zero; either may be what it likes where it is not chosen."""
        return self.b.select(self.nonzero(condition), x, self.constant(0.0) if y is None else y)

    def maximum(self, x: Any, y: Any) -> Any:
        """The larger; NaN if x is. Written so that it is one machine instruction."""
        return self.b.select(self.b.fcmp_ordered(">", y, x), y, x)

    def minimum(self, x: Any, y: Any) -> Any:
        """The smaller; NaN if x is. Written so that it is one machine instruction."""
        return self.b.select(self.b.fcmp_ordered("<", y, x), y, x)

    def exp(self, x: Any) -> Any:
        """Exponential by reduction to |r| <= ln2/2 and a Taylor polynomial of degree 13."""
        x = self.minimum(self.maximum(x, self.constant(-700.0)), self.constant(700.0))
        shifted = self.fma(x, self.constant(_LOG2_E), self.constant(_ROUND))
        k = self.b.fsub(shifted, self.constant(_ROUND))
        r = self.fma(k, self.constant(-_LN2_HIGH), x)
        r = self.fma(k, self.constant(-_LN2_LOW), r)
        value = self.constant(1.0 / math.factorial(13))
        for degree in range(12, -1, -1):
            value = self.fma(value, r, self.constant(1.0 / math.factorial(degree)))
        bits = self.b.bitcast(shifted, self.integer)
        bits = self.b.shl(self.b.add(self.b.and_(bits, self.whole(4095)), self.whole(1023)), self.whole(52))
        bits = self.b.and_(bits, self.whole(0x7FFFFFFFFFFFFFFF))
        return self.b.fmul(value, self.b.bitcast(bits, self.real))

    def log(self, x: Any) -> Any:
        """Natural logarithm of x > 0, by x = 2**e m with m about 1 and the series of artanh."""
        b = self.b
        bits = b.bitcast(x, self.integer)
        e = b.ashr(b.sub(bits, self.whole(0x3FE6A09E667F3BCD)), self.whole(52))
        m = b.bitcast(b.sub(bits, b.shl(e, self.whole(52))), self.real)
        s = b.fdiv(b.fsub(m, self.constant(1.0)), b.fadd(m, self.constant(1.0)))
        z = b.fmul(s, s)
        series = self.constant(1.0 / 21)
        for k in range(19, 1, -2):
            series = self.fma(series, z, self.constant(1.0 / k))
        exponent = b.bitcast(b.or_(b.add(e, self.whole(2048)), self.whole(0x4330000000000000)), self.real)
        exponent = b.fsub(exponent, self.constant(4503599627370496.0 + 2048.0))
        twice = b.fmul(self.constant(2.0), s)
        tail = self.fma(b.fmul(twice, z), series, twice)
        value = self.fma(exponent, self.constant(_LN2_HIGH + _LN2_LOW), tail)
        return b.select(b.fcmp_ordered(">", x, self.constant(0.0)), value, self.constant(math.nan))

    def tanh(self, x: Any) -> Any:
        """Hyperbolic tangent, 1 - 2/(exp(2x) + 1); saturated beyond 20."""
        x = self.minimum(self.maximum(x, self.constant(-20.0)), self.constant(20.0))
        e = self.exp(self.b.fmul(self.constant(2.0), x))
        quotient = self.b.fdiv(self.constant(2.0), self.b.fadd(e, self.constant(1.0)))
        return self.b.fsub(self.constant(1.0), quotient)

    def power(self, x: Any, y: Any) -> Any:
        """x**y for x > 0."""
        return self.exp(self.b.fmul(y, self.log(x)))

    def atan2(self, y: Any, x: Any) -> Any:
        """Angle of a point: its tangent below 1, halved twice, and the series of arctan."""
        b, one = self.b, self.constant(1.0)
        across, along = self.call("fabs", y), self.call("fabs", x)
        larger = self.maximum(along, across)
        at_origin = b.fcmp_ordered("==", larger, self.constant(0.0))
        t = b.fdiv(self.minimum(across, along), b.select(at_origin, one, larger))
        for _ in range(2):
            t = b.fdiv(t, b.fadd(one, self.call("sqrt", self.fma(t, t, one))))
        z = b.fneg(b.fmul(t, t))
        series = self.constant(1.0 / 25)
        for k in range(23, 0, -2):
            series = self.fma(series, z, self.constant(1.0 / k))
        angle = b.fmul(self.constant(4.0), b.fmul(t, series))
        angle = b.select(b.fcmp_ordered(">", across, along), b.fsub(self.constant(0.5 * math.pi), angle), angle)
        angle = b.select(b.fcmp_ordered("<", x, self.constant(0.0)), b.fsub(self.constant(math.pi), angle), angle)
        return self.call("copysign", angle, y)

    def table(self) -> dict[int, Callable[..., Any]]:
        """CasADi's operation codes and what each becomes."""
        b, fast = self.b, (JOINED,)
        one, two = self.constant(1.0), self.constant(2.0)
        return {
            ca.OP_ASSIGN: lambda x: x,
            ca.OP_ADD: lambda x, y: b.fadd(x, y, flags=fast),
            ca.OP_SUB: lambda x, y: b.fsub(x, y, flags=fast),
            ca.OP_MUL: lambda x, y: b.fmul(x, y, flags=fast),
            ca.OP_DIV: b.fdiv,
            ca.OP_NEG: b.fneg,
            ca.OP_INV: lambda x: b.fdiv(one, x),
            ca.OP_SQ: lambda x: b.fmul(x, x, flags=fast),
            ca.OP_TWICE: lambda x: b.fmul(two, x, flags=fast),
            ca.OP_SQRT: lambda x: self.call("sqrt", x),
            ca.OP_FABS: lambda x: self.call("fabs", x),
            ca.OP_FLOOR: lambda x: self.call("floor", x),
            ca.OP_CEIL: lambda x: self.call("ceil", x),
            ca.OP_EXP: self.exp,
            ca.OP_LOG: self.log,
            ca.OP_TANH: self.tanh,
            ca.OP_POW: self.power,
            ca.OP_CONSTPOW: self.power,
            ca.OP_SIN: lambda x: self.call("sin", x),
            ca.OP_COS: lambda x: self.call("cos", x),
            ca.OP_ATAN2: self.atan2,
            ca.OP_FMIN: self.minimum,
            ca.OP_FMAX: self.maximum,
            ca.OP_SIGN: lambda x: b.fsub(
                self.truth(b.fcmp_ordered(">", x, self.constant(0.0))),
                self.truth(b.fcmp_ordered("<", x, self.constant(0.0))),
            ),
            ca.OP_LT: self.compare("<"),
            ca.OP_LE: self.compare("<="),
            ca.OP_EQ: self.compare("=="),
            ca.OP_NE: self.compare("!="),
            ca.OP_NOT: self.negation,
            ca.OP_AND: lambda x, y: self.truth(b.and_(self.nonzero(x), self.nonzero(y))),
            ca.OP_OR: lambda x, y: self.truth(b.or_(self.nonzero(x), self.nonzero(y))),
            ca.OP_IF_ELSE_ZERO: self.chosen,
            SELECT: self.chosen,
        }

    def run(self, program: Program, inputs: Sequence[Any], outputs: Sequence[Any], kept: Mapping[int, int]) -> None:
        """Emit a whole program; every output is stored after every input was read, so they may overlap."""
        graph, table = graph_of(program), self.table()
        values: dict[int, Any] = {}
        order = schedule(graph)
        inside = {k for item in order if isinstance(item, Branch) for k in (*item.then, *item.otherwise)}
        found = writes(graph, kept, inside)
        behind = inside.intersection(found.nodes())

        def emit(place: int) -> None:
            node = graph.nodes[place]
            if node.code == ca.OP_INPUT:
                address = self.address(inputs[node.place[0]], node.place[1])
                values[place] = self.b.load(address, typ=self.real, align=8)
            elif node.code == ca.OP_CONST:
                values[place] = self.constant(node.value)
            else:
                values[place] = table[node.code](*(values[s] for s in node.sources))

        def emit_all(places: Sequence[int]) -> None:
            for group in packed(graph, places) if self.width == 1 else ((place,) for place in places):
                if len(group) == 1:
                    emit(group[0])
                else:
                    self.together([(k, graph.nodes[k]) for k in group], values)

        plain: list[int] = []  # since the last branch
        for item in order:
            if not isinstance(item, Branch):
                plain.append(item)
                continue
            emit_all(plain)
            plain.clear()
            branch = self.branch if self.width == 1 else self.branch_of_any
            branch(item, values, emit_all, behind)
        emit_all(plain)
        self.store(found, values, outputs)

    def together(self, group: Sequence[tuple[int, Node]], values: dict[int, Any]) -> None:
        """Emit operations of one kind and one run as one vector operation; places that are left over have ones."""
        beside = _Emitter(self.b, 2 if len(group) == 2 else AT_ONCE)
        places = [ir.Constant(ir.IntType(32), n) for n in range(len(group))]

        def vector(of: Sequence[Any]) -> Any:
            found = beside.constant(1.0)
            for n, one in zip(places, of, strict=True):
                found = self.b.insert_element(found, one, n)
            return found

        operands = [[values[source] for source in node.sources] for _, node in group]
        code = group[0][1].code
        if code in (ca.OP_DIV, ca.OP_INV):  # an inverse divides 1
            code, operands = ca.OP_DIV, [[self.constant(1.0), *of][-2:] for of in operands]
        result = beside.table()[code](*map(vector, zip(*operands, strict=True)))
        for n, (place, _) in zip(places, group, strict=True):
            values[place] = self.b.extract_element(result, n)

    def store(self, found: Writes, values: Mapping[int, Any], outputs: Sequence[Any], runs: Any = None) -> None:
        """Store results, those of a case in a branch of their own.

        Args:
            runs: side by side, those whose case this is; all, if None.
        """
        for (output, element), place in found.always:
            address, value = self.address(outputs[output], element), values[place]
            if runs is not None:
                value = self.b.select(runs, value, self.b.load(address, typ=self.real, align=8))
            self.b.store(value, address, align=8)
        for condition, both in found.cases.items():
            holds = self.nonzero(values[condition])
            if self.width == 1:
                with self.b.if_else(holds) as cases:
                    for block, case in zip(cases, both, strict=True):
                        with block:
                            self.store(case, values, outputs)
                continue
            for concerned, case in zip((holds, self.b.not_(holds)), both, strict=True):
                if case.always or case.cases:
                    among = concerned if runs is None else self.b.and_(runs, concerned)
                    with self.b.if_then(self.any_of(among)):
                        self.store(case, values, outputs, among)

    def any_of(self, runs: Any) -> Any:
        """Whether any of the runs side by side is."""
        word = ir.IntType(self.width)
        return self.b.icmp_unsigned("!=", self.b.bitcast(runs, word), word(0))

    def branch(
        self, branch: Branch, values: dict[int, Any], emit: Callable[[Sequence[int]], None], behind: Collection[int]
    ) -> None:
        """Emit one case or the other, and what is chosen behind them.

        Args:
            behind: operations of which the value is asked for again where their case is known to have been the one.
        """
        zero, any_value = self.constant(0.0), ir.Constant(self.real, ir.Undefined)
        ends: list[tuple[Any, list[Any]]] = []
        asked = [k for k in (*branch.then, *branch.otherwise) if k in behind]
        with self.b.if_else(self.nonzero(values[branch.condition])) as cases:
            for case, block in enumerate(cases):
                with block:
                    emit((branch.then, branch.otherwise)[case])
                    kept = [zero if k is None else values[k] for k in (v[case] for v in branch.chosen.values())]
                    kept += [values[k] if k in (branch.then, branch.otherwise)[case] else any_value for k in asked]
                    ends.append((self.b.block, kept))
        for number, place in enumerate((*branch.chosen, *asked)):
            values[place] = self.b.phi(self.real)
            for block, kept in ends:
                values[place].add_incoming(kept[number], block)

    def branch_of_any(
        self, branch: Branch, values: dict[int, Any], emit: Callable[[Sequence[int]], None], behind: Collection[int]
    ) -> None:
        """Emit the short case, and the long one for all runs as soon as it is the case of any of them."""
        zero, cases = self.constant(0.0), (branch.then, branch.otherwise)
        long = int(len(branch.otherwise) > len(branch.then))
        emit(cases[1 - long])
        shorts = [zero if k is None else values[k] for k in (both[1 - long] for both in branch.chosen.values())]
        holds = self.nonzero(values[branch.condition])
        concerned = self.b.not_(holds) if long else holds
        before, any_value = self.b.block, ir.Constant(self.real, ir.Undefined)
        asked = [k for k in cases[long] if k in behind]
        with self.b.if_then(self.any_of(concerned)):
            emit(cases[long])
            longs = [zero if k is None else values[k] for k in (both[long] for both in branch.chosen.values())]
            mixed = [self.b.select(concerned, new, one) for new, one in zip(longs, shorts, strict=True)]
            mixed += [values[k] for k in asked]
            shorts += [any_value] * len(asked)
            after = self.b.block
        for place, one, new in zip((*branch.chosen, *asked), shorts, mixed, strict=True):
            values[place] = self.b.phi(self.real)
            values[place].add_incoming(one, before)
            values[place].add_incoming(new, after)

    def address(self, base: Any, element: int) -> Any:
        offset = ir.Constant(ir.IntType(64), element * self.width)
        return self.b.bitcast(self.b.gep(base, [offset], source_etype=ir.DoubleType()), self.real.as_pointer())


def emit_program(
    module: Any,
    name: str,
    program: Program,
    inputs: int,
    outputs: int,
    width: int = 1,
    *,
    kept: Mapping[int, int] | None = None,
) -> Any:
    """Emit a program as a function of its own, which stays one.

    Args:
        width: runs side by side. With 1 the arrays have shape (n,), else (n, width).

    Returns:
        The function, of pointers to the inputs and then to the outputs; an output may be an input.
    """
    pointers = [ir.DoubleType().as_pointer()] * (inputs + outputs)
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), pointers), name)
    function.linkage = "internal"
    function.attributes.add("noinline")
    builder = ir.IRBuilder(function.append_basic_block())
    _Emitter(builder, width).run(program, function.args[:inputs], function.args[inputs:], kept or {})
    builder.ret_void()
    return function
