"""The Content-Security-Policy of the pages that are written to disk: they load nothing, whatever text is in them."""

import base64
import hashlib


def policy(script: str = "", live: bool = False) -> str:
    """The policy: nothing from anywhere, and of scripts this one alone (none if empty).

    Args:
        script: the page's own.
        live: whether the page asks its own server, and sends its buttons there.
    """
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    scripts = f"; script-src 'sha256-{digest}'" if script else ""
    own = "form-action 'self'; connect-src 'self'" if live else "form-action 'none'"
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; {own}{scripts}"


def policy_tag(script: str = "") -> str:
    """The policy as an element of a page's head, to stand before all that could load something."""
    return f'<meta http-equiv="Content-Security-Policy" content="{policy(script)}">'
