"""How a message asks for what a file leaves unsaid: settings that work as they are printed."""

from collections.abc import Mapping


def say(*choices: Mapping[str, str | float]) -> str:
    """The options of the commands, and the keys of params.yaml, that settle a question.

    Args:
        choices: settings by name, one dict for each answer that may be right.
    """
    options = " or ".join(" ".join(f"--set {key}={value}" for key, value in settings.items()) for settings in choices)
    keys = dict.fromkeys(key for settings in choices for key in settings)
    return f"Say it: {options} (for the loop, in params.yaml: {', '.join(f'motions.read.{key}' for key in keys)})."
