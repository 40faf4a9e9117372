"""Makes Taichi's front end quicker: it is most of what a first step costs once kernels are in the disk cache.

Taichi 1.7 looks up and reads the source of a function again wherever it is called from a kernel, and draws the position
of every piece of syntax for error messages that are hardly ever printed. Here sources are remembered, and a position
is told in one plain line.

It also works out anew at every launch which compiled kernel its arguments ask for, and how they are passed: some 40
microseconds, twenty times a step. A kernel that takes an object with fields, and numbers else, is launched at once
from its second call on.

Where another version of Taichi has these elsewhere, it stays as slow as it was.
"""

from __future__ import annotations

import ast
import functools
import weakref
from collections.abc import Callable
from dataclasses import dataclass


def quicken() -> None:
    """Replace the slow parts of Taichi's front end; to be called once, before the first kernel is compiled."""
    from taichi.lang import kernel_impl
    from taichi.lang.ast import ast_transformer_utils

    for name in ("getsourcefile", "getsourcelines"):
        look_up = getattr(kernel_impl, name, None)
        if look_up is not None:
            setattr(kernel_impl, name, functools.cache(look_up))
    context = getattr(ast_transformer_utils, "ASTTransformerContext", None)
    if hasattr(context, "get_pos_info"):
        context.get_pos_info = _position
    kernel_impl.Kernel.__call__ = _launching(kernel_impl.Kernel.__call__)


def _position(context, node: ast.AST) -> str:
    """File, line and source of a piece of syntax, as Taichi's messages have it."""
    place = f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:'
    return f"{place}\n{context.src[node.lineno - 1]}\n"


def _launching(call: Callable) -> Callable:
    """`Kernel.__call__`, made quick for kernels whose arguments allow it."""

    @functools.wraps(call)
    def launch(kernel, *args, **keywords):
        plans = kernel.__dict__.get("_plans", {})
        plan = plans.get(args[0]) if plans else None
        runtime = kernel.runtime
        if plan is None or len(args) != len(plan.setters) + 1 or runtime.prog is not plan.program:
            result = call(kernel, *args, **keywords)
            _plan(kernel, args)
            return result
        if keywords or runtime.target_tape or runtime.fwd_mode_manager:
            return call(kernel, *args, **keywords)
        context = plan.context()
        for slot, put in enumerate(plan.setters):
            getattr(context, put)((slot,), args[slot + 1])
        plan.program.launch_kernel(plan.compiled, context)
        return None

    return launch


@dataclass(frozen=True)
class _Plan:
    """How a kernel is launched again for the same object: what makes its context, and sets the numbers there."""

    program: object
    compiled: object
    context: Callable
    setters: list[str]


def _plan(kernel, args: tuple) -> None:
    """Remember how a kernel that was just called is launched again, unless its arguments are of other kinds."""
    from taichi.lang import kernel_impl
    from taichi.types import primitive_types, template

    if not args or len(args) != len(kernel.arguments) or not hasattr(args[0], "_data_oriented"):
        return
    first, *others = (argument.annotation for argument in kernel.arguments)
    kinds = dict.fromkeys(primitive_types.real_type_ids, "set_arg_float")
    kinds |= {id(kind): "set_arg_int" for kind in (primitive_types.i32, primitive_types.i64)}
    setters = [kinds.get(id(kind)) for kind in others]
    undifferentiated = kernel.autodiff_mode == kernel_impl.AutodiffMode.NONE
    returns = kernel.return_type is not None or kernel.has_print
    if None in setters or not isinstance(first, template) or returns or not undifferentiated:
        return
    of_arguments = kernel.compiled_kernels[kernel.ensure_compiled(*args)]
    program = kernel.runtime.prog
    compiled = program.compile_kernel(program.config(), program.get_device_caps(), of_arguments)
    plans = kernel.__dict__.setdefault("_plans", weakref.WeakKeyDictionary())
    plans[args[0]] = _Plan(program, compiled, of_arguments.make_launch_context, setters)
