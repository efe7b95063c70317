"""How machine code is entered: with the addresses of NumPy's arrays, whose data and shape it finds there itself.

Handing over data and shapes one by one would take longer than a sensor's step. The layout is that of NumPy's
`PyArrayObject_fields`, which is part of its binary interface: data at 16, dimensions at 32 bytes from the beginning.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
from llvmlite import ir
from numba.extending import intrinsic

_numba: Any = numba  # which does not say what it exports
types, carray = _numba.types, _numba.carray

_DATA, _SHAPE = 16, 32


@intrinsic
def _word(typing_context: Any, address: Any) -> Any:
    """The 64-bit integer at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        return builder.load(builder.inttoptr(arguments[0], word.as_pointer()), typ=word)

    return types.int64(types.int64), emit


def _pointer_to(kind: Any) -> Any:
    @intrinsic
    def pointer(typing_context: Any, address: Any) -> Any:
        def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return types.CPointer(kind)(types.int64), emit

    return pointer


_POINTERS = {"float64": _pointer_to(types.float64), "int64": _pointer_to(types.int64)}


def names() -> dict[str, Any]:
    """What the source of an entry refers to."""
    return {"carray": carray, "word": _word, **_POINTERS}


def entry_source(dtypes: Sequence[str], dimensions: Sequence[int]) -> str:
    """The source of `entry`, which calls `function` with arrays at addresses, and with numbers.

    Args:
        dtypes: of the arguments.
        dimensions: of the arrays; 0 for a number.

    Example:
        >>> print(entry_source(["float64", "float64"], [1, 0]))
        def entry(a0, a1):
            return function(carray(float64(word(a0 + 16)), (word(word(a0 + 32) + 0),)), a1)
    """
    passed = []
    for k, (dtype, count) in enumerate(zip(dtypes, dimensions, strict=True)):
        shape = "".join(f"word(word(a{k} + {_SHAPE}) + {8 * d})," for d in range(count))
        passed.append(f"carray({dtype}(word(a{k} + {_DATA})), ({shape}))" if count else f"a{k}")
    flat = ", ".join(f"a{k}" for k in range(len(passed)))
    return f"def entry({flat}):\n    return function({', '.join(passed)})"
