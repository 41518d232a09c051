"""Libraries of the extra `logs`: there, or one line that says how to get them."""

import importlib
from types import ModuleType

from bumblebee.errors import BadInput


def library(kind: str, module: str) -> ModuleType:
    """A module of an optional library.

    Args:
        kind: the layout that needs it, for the message.
        module: its full name.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        name = module.split(".")[0]
        do = "In the checkout: pip install -e '.[logs]'"
        raise BadInput(kind, f"the library {name}", "none installed", do) from None
