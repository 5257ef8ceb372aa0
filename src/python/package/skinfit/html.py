"""A page of skinfit's within a notebook's."""

from __future__ import annotations

from html import escape


def framed(page: str, height: int = 720) -> str:
    """The page in a frame of its own, so that its style and the notebook's do not meet; `height` in pixels."""
    return f'<iframe srcdoc="{escape(page)}" style="width: 100%; height: {height}px; border: 0"></iframe>'
