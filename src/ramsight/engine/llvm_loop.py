"""LLVM code of a loop around a graph's operations, from its Python.

The loops are Python that a test can run as it stands; here each becomes one function of machine code. It is entered
with the addresses of NumPy's arrays, whose data and shape it finds there itself: handing over data and shapes one by
one would take longer than a sensor's step.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from llvmlite import ir

from ramsight.engine.object_code import ENTRY, Kinds
from ramsight.engine.terms import REAL, WHOLE, LoopError, Terms, View, whole

Call = Callable[[Any, str, Sequence[View]], bool]
"""Emits the call of a function of the graph, by a builder; false if it is not one."""


def emit_loop(
    module: ir.Module,
    source: ast.FunctionDef,
    kinds: Kinds,
    constants: Mapping[str, object],
    call: Call,
    steps: Mapping[str, ast.FunctionDef],
) -> int:
    """Emit a loop into a module, as `int64 loop(workspace, arguments...)`.

    Arrays are handed over by their addresses as int64, numbers as double. What it returns is a whole number, 0 if it
    returns nothing.

    Args:
        steps: functions beside it, written out where it calls them.

    Returns:
        The size of the workspace, memory for its own arrays [8 bytes].

    Raises:
        LoopError: There is something in it that is not known.
    """
    arguments = [WHOLE if dimensions else REAL for _, dimensions in kinds]
    function = ir.Function(module, ir.FunctionType(WHOLE, [REAL.as_pointer(), *arguments]), ENTRY)
    entry = ir.IRBuilder(function.append_basic_block("entry"))
    builder = ir.IRBuilder(function.append_basic_block("body"))
    terms = Terms(builder, entry, constants, function.args[0])
    for argument, value, kind in zip(source.args.args, function.args[1:], kinds, strict=True):
        terms.argument(argument.arg, value, *kind)
    _Statements(terms, call, steps).all(source.body)
    if not builder.block.is_terminated:
        builder.ret(whole(0))
    entry.branch(function.blocks[1])
    return terms.words


class _Statements:
    """Emits statements where a builder stands."""

    def __init__(self, terms: Terms, call: Call, steps: Mapping[str, ast.FunctionDef]) -> None:
        self._terms, self._b, self._call, self._steps = terms, terms.b, call, steps

    def all(self, statements: Sequence[ast.stmt]) -> None:
        """What stands behind a jump is left out."""
        for statement in statements:
            if self._b.block.is_terminated:
                return
            method = getattr(self, f"_{type(statement).__name__.lower()}", None)
            if method is None:
                raise LoopError(f"not known in a loop: {ast.unparse(statement)}")
            method(statement)

    def _assign(self, node: ast.Assign) -> None:
        value = self._terms(node.value)
        for target in node.targets:
            self._give(target, value)

    def _give(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Tuple):
            for one, part in zip(target.elts, value, strict=True):
                self._give(one, part)
        elif isinstance(target, ast.Name):
            self._terms.store(target.id, value)
        elif isinstance(target, ast.Subscript):
            place = self._terms.part(target)
            if place.shape or isinstance(value, View):
                raise LoopError(f"not known in a loop: a part of an array as a whole: {ast.unparse(target)}")
            self._b.store(self._terms.as_kind(value, place.kind), place.data)
        else:
            raise LoopError(f"not known in a loop: {ast.unparse(target)}")

    def _augassign(self, node: ast.AugAssign) -> None:
        before = self._terms(node.target)
        self._give(node.target, self._terms.arithmetic(node.op, before, self._terms(node.value)))

    def _expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):  # what it says of itself
            return
        if isinstance(node.value, ast.Call):
            name, values = ast.unparse(node.value.func), [self._terms(argument) for argument in node.value.args]
            if name in self._steps:
                self._step(self._steps[name], values)
                return
            if self._call(self._b, name, values):
                return
        raise LoopError(f"not known in a loop: {ast.unparse(node)}")

    def _step(self, source: ast.FunctionDef, values: Sequence[Any]) -> None:
        """The statements of a function that returns nothing, with names of their own; arrays are the caller's."""
        if any(isinstance(one, ast.Return) for one in ast.walk(source)):
            raise LoopError(f"a step of a loop returns: {source.name}")
        with self._terms.named({one.arg: value for one, value in zip(source.args.args, values, strict=True)}):
            self.all(source.body)

    def _if(self, node: ast.If) -> None:
        with self._b.if_else(self._terms(node.test)) as (then, otherwise):
            with then:
                self.all(node.body)
            with otherwise:
                self.all(node.orelse)

    def _for(self, node: ast.For) -> None:
        if not (isinstance(node.target, ast.Name) and isinstance(node.iter, ast.Call)):
            raise LoopError(f"not known in a loop: {ast.unparse(node)}")
        limits = [self._terms(argument) for argument in node.iter.args]
        begin, end, *step = limits if len(limits) > 1 else (whole(0), *limits)
        with self._terms.counting(begin, end, *step) as k:
            self._terms.store(node.target.id, k)  # which may get another value inside
            self.all(node.body)

    def _while(self, node: ast.While) -> None:
        test, inside, after = (self._b.append_basic_block(at) for at in ("test", "inside", "after"))
        self._b.branch(test)
        self._b.position_at_end(test)
        self._b.cbranch(self._terms(node.test), inside, after)
        self._b.position_at_end(inside)
        self._terms.around.append((test, after))
        self.all(node.body)
        self._terms.around.pop()
        if not self._b.block.is_terminated:
            self._b.branch(test)
        self._b.position_at_end(after)

    def _continue(self, _: ast.Continue) -> None:
        self._b.branch(self._terms.around[-1][0])

    def _break(self, _: ast.Break) -> None:
        self._b.branch(self._terms.around[-1][1])

    def _return(self, node: ast.Return) -> None:
        self._b.ret(self._terms(node.value) if node.value is not None else whole(0))
