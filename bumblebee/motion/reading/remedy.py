"""How a message asks for what a file leaves unsaid: settings that work as they are printed."""

from collections.abc import Mapping


def say(*choices: Mapping[str, str | float]) -> str:
    """The options of the commands, and the keys of params.yaml, that settle a question.

    Args:
        choices: settings by name, one dict for each answer that may be right.
    """
    options = " or ".join(" ".join(_option(*said) for said in settings.items()) for settings in choices)
    keys = dict.fromkeys(key for settings in choices for key in settings)
    return f"Say it: {options} (for the loop, in params.yaml: {', '.join(f'motions.read.{key}' for key in keys)})."


def _option(key: str, value: str | float) -> str:
    """The option of the commands that states a setting; the rate of CSV files has its own."""
    return f"--csv-fps {value}" if key == "csv_fps" else f"--set {key}={value}"
