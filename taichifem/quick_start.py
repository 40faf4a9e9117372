"""Makes Taichi's front end quicker: it is most of what a first step costs once kernels are in the disk cache.

Taichi 1.7 looks up and reads the source of a function again wherever it is called from a kernel, and draws the position
of every piece of syntax for error messages that are hardly ever printed. Here sources are remembered, and a position
is told in one plain line.

It also works out anew at every launch which compiled kernel its arguments ask for, and how they are passed: some 40
microseconds, and 20 more for every array. A kernel that takes objects with fields, NumPy's arrays and numbers, and
returns at most a number, is launched at once when it has been called twice with such arguments.

Where another version of Taichi has these elsewhere, it stays as slow as it was.
"""

from __future__ import annotations

import ast
import functools
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


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
        runtime, slots = kernel.runtime, kernel.__dict__.get("_slots")
        if keywords or runtime.target_tape or runtime.fwd_mode_manager:
            return call(kernel, *args, **keywords)
        key = slots.key(args) if slots else None
        plan = slots.plans.get(key) if slots else None
        again = plan is not None and plan.program is runtime.prog
        if not again or plan.compiled is None:
            result = call(kernel, *args)
            if slots is None:
                slots = kernel.__dict__["_slots"] = _slots_of(kernel, args)
                key = slots.key(args)
            if key is not None:
                slots.plans[key] = _plan(kernel, args, slots, key, again=again)
            return result
        context = plan.context()
        for slot, k in slots.arrays:
            array = args[k]
            context.set_arg_external_array_with_shape((slot,), array.ctypes.data, array.nbytes, array.shape, 0)
        for slot, k, put in slots.numbers:
            getattr(context, put)((slot,), args[k])
        plan.program.launch_kernel(plan.compiled, context)
        if slots.returned is None:
            return None
        runtime.sync()
        return getattr(context, slots.returned)((0,))

    return launch


@dataclass(frozen=True)
class _Plan:
    """How a kernel is launched again for the same objects: what makes its context. alive: notices of their end.

    compiled, context: None after the first call. Many a kernel has no other, and to ask for these takes milliseconds.
    """

    program: object
    compiled: object | None
    context: Callable | None
    alive: list[weakref.ref]


@dataclass(frozen=True)
class _Slots:
    """Which of a kernel's arguments are what, by position, and its plans.

    count: arguments; 0 if there cannot be plans.  objects, constants: templates that have fields, or are whole numbers.
    arrays (slot, position), numbers (slot, position, what sets them): slots do not count templates.
    returned: what reads the result.
    """

    count: int = 0
    objects: list[int] = field(default_factory=list)
    constants: list[int] = field(default_factory=list)
    arrays: list[tuple[int, int]] = field(default_factory=list)
    numbers: list[tuple[int, int, str]] = field(default_factory=list)
    returned: str | None = None
    plans: dict[tuple, _Plan] = field(default_factory=dict)

    def key(self, args: tuple) -> tuple | None:
        """What the compiled kernel depends on; None if Taichi has to look at the arguments."""
        if not self.count or len(args) != self.count:
            return None
        key = [id(args[k]) for k in self.objects]
        for k in self.constants:
            if type(args[k]) is not int:
                return None
            key.append(args[k])
        for _, k in self.arrays:
            array = args[k]
            if type(array) is not np.ndarray or not array.flags.c_contiguous:
                return None
            key += (array.dtype, array.ndim)
        return tuple(key)


def _slots_of(kernel, args: tuple) -> _Slots:
    """What the arguments of a kernel that was just called are."""
    from taichi.lang import kernel_impl
    from taichi.lang.field import Field
    from taichi.types import ndarray_type, primitive_types, template

    putting = dict.fromkeys(primitive_types.real_type_ids, "set_arg_float")
    getting = dict.fromkeys(primitive_types.real_type_ids, "get_struct_ret_float")
    for kind in (primitive_types.i32, primitive_types.i64):
        putting[id(kind)], getting[id(kind)] = "set_arg_int", "get_struct_ret_int"
    returned = [getting.get(id(kind)) for kind in kernel.return_type or ()]
    known = len(args) == len(kernel.arguments) and kernel.autodiff_mode == kernel_impl.AutodiffMode.NONE
    if not known or kernel.has_print or len(returned) > 1 or None in returned:
        return _Slots()
    slots = _Slots(len(args), returned=returned[0] if returned else None)
    for k, (argument, value) in enumerate(zip(kernel.arguments, args, strict=True)):
        kind, slot = argument.annotation, len(slots.arrays) + len(slots.numbers)
        if isinstance(kind, template) and (isinstance(value, Field) or hasattr(value, "_data_oriented")):
            slots.objects.append(k)
        elif isinstance(kind, template) and type(value) is int:
            slots.constants.append(k)
        elif isinstance(kind, ndarray_type.NdarrayType) and kind.dtype is None:
            slots.arrays.append((slot, k))
        elif id(kind) in putting:
            slots.numbers.append((slot, k, putting[id(kind)]))
        else:
            return _Slots()
    return slots


def _plan(kernel, args: tuple, slots: _Slots, key: tuple, *, again: bool) -> _Plan:
    """Remember how a kernel that was just called is launched again. again: had it been called so before?"""
    # Another object may come to have the place in memory of one that ended.
    alive = [weakref.ref(args[k], lambda _: slots.plans.pop(key, None)) for k in slots.objects]
    program, compiled, context = kernel.runtime.prog, None, None
    if again:
        of_arguments = kernel.compiled_kernels[kernel.ensure_compiled(*args)]
        compiled = program.compile_kernel(program.config(), program.get_device_caps(), of_arguments)
        context = of_arguments.make_launch_context
    return _Plan(program, compiled, context, alive)
