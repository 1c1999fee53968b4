"""A player's page -> a fragment of HTML that holds it inside another page."""

from __future__ import annotations

import html


def embedded(page: str, label: str) -> str:
    """An ``iframe`` with the whole page of ``animation.page`` in it, for another page's body.

    The page inside may run its script and nothing else: it sees nothing of the page around it.

    label : what it is, for those who cannot see it
    """
    return (
        f'<iframe class="player" title="{html.escape(label)}" loading="lazy" '
        f'sandbox="allow-scripts" srcdoc="{html.escape(page)}"></iframe>'
    )
