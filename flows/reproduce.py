"""`dvc --wait-for-lock repro -s STAGE` in a process that ends with the flow: `python -m flows.reproduce STAGE`."""

import sys

from tasks.parent import end_with_parent


def main(argv: list[str] | None = None) -> int:
    """Bring the named stages up to date; DVC's exit status."""
    end_with_parent()
    from dvc.cli import main as dvc

    names = sys.argv[1:] if argv is None else argv
    # Waiting for the lock matters: of stages that run side by side one would otherwise lose its finished work.
    return int(dvc(["--wait-for-lock", "repro", "--single-item", *names]))


if __name__ == "__main__":
    raise SystemExit(main())
