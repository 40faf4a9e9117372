"""Makes Taichi's front end quicker: it is most of what a first step costs once kernels are in the disk cache.

Taichi 1.7 looks up and reads the source of a function again wherever it is called from a kernel, and draws the position
of every piece of syntax for error messages that are hardly ever printed. Here sources are remembered, and a position
is told in one plain line. Where another version of Taichi has these elsewhere, it stays as slow as it was.
"""

from __future__ import annotations

import ast
import functools


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


def _position(context, node: ast.AST) -> str:
    """File, line and source of a piece of syntax, as Taichi's messages have it."""
    place = f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:'
    return f"{place}\n{context.src[node.lineno - 1]}\n"
