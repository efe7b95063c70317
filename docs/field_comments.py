"""What the comments beside the fields of a dataclass say, for the pages: a field is described once, where it stands."""

from __future__ import annotations

import ast
import inspect
import io
import textwrap
import tokenize


def said_of_fields(kind: type) -> dict[str, str]:
    """What the comments beside a dataclass's fields say of them, or those above that name them: ``low, high: text``."""
    source = textwrap.dedent(inspect.getsource(kind))
    body = ast.parse(source).body[0].body
    fields = {node.target.id: node for node in body if isinstance(node, ast.AnnAssign)}
    comments, alone = {}, set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            comments[token.start[0]] = token.string.lstrip("# ")
            alone |= {token.start[0]} if token.line.lstrip().startswith("#") else set()
    found = {}
    for name, node in fields.items():
        if node.end_lineno in comments:
            found[name] = comments[node.end_lineno]
        above = []
        while (line := node.lineno - 1 - len(above)) in alone:
            above.insert(0, comments[line])
        names, _, text = " ".join(above).partition(": ")
        if text and set(names.split(", ")) <= fields.keys():
            found[names.replace(", ", "/")] = text
    return found
