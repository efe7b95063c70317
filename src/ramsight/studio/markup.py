"""Pieces of pages that several of them have."""

from __future__ import annotations

from html import escape


def scrolled(text: str, name: str) -> str:
    """Lines as they are, which may be wider than the page: whoever has no mouse gets there with keys and scrolls.

    Args:
        text: the lines.
        name: what they are, for whoever does not see them.

    Example:
        >>> scrolled("a < b", "a comparison")
        '<pre tabindex="0" role="region" aria-label="a comparison">a &lt; b</pre>'
    """
    return f'<pre tabindex="0" role="region" aria-label="{escape(name)}">{escape(text)}</pre>'
