"""Pieces of pages that several of them have."""

from __future__ import annotations

from html import escape
from urllib.parse import quote


def served_under(prefix: str, path: str) -> str:
    """A path of the studio's own files as the page asks for it, behind a proxy that serves the studio under a prefix.

    Args:
        prefix: of the proxy, as the header ``X-Forwarded-Prefix`` states it; anybody can send it.

    Example:
        >>> served_under("/rig", "/studio-assets/studio.js"), served_under('"><script>', "/studio-assets/studio.js")
        ('/rig/studio-assets/studio.js', '/%22%3E%3Cscript%3E/studio-assets/studio.js')
    """
    inner = quote(prefix.strip("/"), safe="/")
    return f"/{inner}{path}" if inner else path


def scrolled(text: str, name: str) -> str:
    """Lines as they are, which may be wider than the page: whoever has no mouse gets there with keys and scrolls.

    Example:
        >>> scrolled("a < b", "a comparison")
        '<pre tabindex="0" role="region" aria-label="a comparison">a &lt; b</pre>'
    """
    return f'<pre tabindex="0" role="region" aria-label="{escape(name)}">{escape(text)}</pre>'
