"""Generated modules, named by the hash of all they depend on; their machine code is kept on disk."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import casadi as ca

from ramsight.engine.object_code import Kinds, NativeFunction
from ramsight.engine.private_folder import cache_directory, content_hash
from ramsight.expression import Vector

if TYPE_CHECKING:
    from ramsight.engine.terms import View

WIDTH = 8
"""Runs side by side: one AVX-512 register of doubles, two of AVX2."""
_loaded: dict[str, CompiledModule] = {}


def instructions(function: ca.Function) -> list[list[Any]]:
    """The elementary operations of an SX function, in order: `[operation, target, sources, constant]`.

    Registers are those of CasADi; `target` and `sources` are pairs (argument, element) for inputs and outputs.
    """
    listing = []
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        target, sources = function.instruction_output(k), function.instruction_input(k)
        value = function.instruction_constant(k) if code == ca.OP_CONST else 0.0
        listing.append([code, target, sources, value])
    return listing


def generated_module(
    functions: Mapping[str, ca.Function],
    constants: Mapping[str, object],
    body: str,
    widths: Mapping[str, int] | None = None,
) -> CompiledModule:
    """A compiled module made of SX functions and of Python source that calls them.

    Compiling takes seconds when the content is new and a fraction of a second when it was seen before here.

    Args:
        functions: SX functions by name; each becomes `name(inputs..., outputs...)` on float64 arrays. The sparse
            entries of an input or output are its nonzeros. An output `b_new` is written over the input `b`.
        constants: module-level names that `body` uses.
        body: source of further functions, of what `engine.terms` and `engine.loop` know.
        widths: functions that work on several runs side by side, and on how many; their arrays are (n, width).
    """
    from ramsight.engine import branches, graph, llvm, llvm_loop, packing, terms, writes

    widths = {name: (widths or {}).get(name, 1) for name in functions}
    name = "model_" + content_hash(
        *(text for name, function in functions.items() for text in (name, function.serialize())),
        repr((list(constants.items()), widths)),
        body,
        *map(inspect.getsource, (graph, branches, packing, writes, llvm, terms, llvm_loop)),
        ca.CasadiMeta.version(),
    )
    return kept_module(name, lambda: functions, constants, body, widths)


def kept_module(
    name: str,
    functions: Callable[[], Mapping[str, ca.Function]],
    constants: Mapping[str, object],
    body: str,
    widths: Mapping[str, int],
) -> CompiledModule:
    """The module of a name that `generated_module` gave; its functions are asked for where it has to be compiled."""
    if name not in _loaded:
        _loaded[name] = CompiledModule(name, functions, constants, body, widths)
    return _loaded[name]


class CompiledModule:
    """A generated module. Source and operations come from memory; only machine code is kept in the cache's folder.

    Args:
        functions: gives what it is made of, by name.
    """

    def __init__(
        self,
        name: str,
        functions: Callable[[], Mapping[str, ca.Function]],
        constants: Mapping[str, object],
        body: str,
        widths: Mapping[str, int],
    ) -> None:
        self._folder, self.name = cache_directory(), name
        self._made, self._widths = functions, widths
        statements = ast.parse(body).body
        self._loops = {one.name: one for one in statements if isinstance(one, ast.FunctionDef)}
        self._constants: dict[str, Any] = dict(constants)
        rest: list[ast.stmt] = [one for one in statements if isinstance(one, ast.Assign)]
        exec(compile(ast.Module(rest, []), f"<{name}>", "exec"), {}, self._constants)  # noqa: S102  our own source

    @cached_property
    def _functions(self) -> Mapping[str, ca.Function]:
        return self._made()

    def __getattr__(self, name: str) -> Any:
        if name in self._loops or name in self._widths:
            value: Any = NativeFunction(partial(self._written, name), f"{self.name}.{name}", self._folder)
        elif name in self._constants:
            value = self._constants[name]
        else:
            raise AttributeError(name)
        self.__dict__[name] = value
        return value

    def _written(self, name: str, kinds: Kinds) -> tuple[str, int]:
        """The text of a function for LLVM, and the size of its workspace."""
        from llvmlite import ir

        from ramsight.engine import llvm_loop

        module = ir.Module(name)
        source = self._loops.get(name) or self._alone(name)
        words = llvm_loop.emit_loop(module, source, kinds, self._constants, self._call, self._loops)
        return str(module), words

    def _alone(self, name: str) -> ast.FunctionDef:
        """A loop that calls one function once."""
        call = f"{name}({', '.join(_arguments(self._functions[name]))})"
        (source,) = ast.parse(f"def {call}:\n    {call}").body
        assert isinstance(source, ast.FunctionDef)
        return source

    def _call(self, builder: Any, name: str, views: Sequence[View]) -> bool:
        """Emit the call of a function, and the function if it is the first."""
        if name not in self._widths:
            return False
        from ramsight.engine import llvm

        function, module = self._functions[name], builder.module
        inputs, outputs = function.name_in(), [out.removesuffix("_new") for out in function.name_out()]
        symbol = f"operations.{name}"
        emitted = module.globals.get(symbol) or llvm.emit_program(
            module,
            symbol,
            instructions(function),
            len(inputs),
            len(outputs),
            self._widths[name],
            kept={k: inputs.index(out) for k, out in enumerate(outputs) if out in inputs},
        )
        named = dict(zip(_arguments(function), views, strict=True))
        builder.call(emitted, [named[name].data for name in (*inputs, *outputs)])
        return True


def _arguments(function: ca.Function) -> list[str]:
    """The names of inputs and outputs; an output named like an input overwrites it."""
    return list(dict.fromkeys([*function.name_in(), *(out.removesuffix("_new") for out in function.name_out())]))


def hold(expression: Vector, parameters: Vector) -> tuple[Vector, Vector, ca.Function]:
    """Take out of an expression what depends on parameters alone, to be computed once.

    Returns:
        The reduced expression, the symbols `q` that stand for what was taken out (and for the parameters), and the
        function `prepare(p) -> q`.
    """
    reduced, symbols, values = ca.extract_parametric(ca.cse(expression), parameters)
    q = ca.vertcat(*symbols, parameters)
    result = ca.densify(ca.vertcat(*values, parameters))
    return reduced, q, ca.Function("prepare", [parameters], [result], ["p"], ["q"], {"cse": True})
