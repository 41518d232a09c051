"""Known layouts of logs, read as rollouts of the contract."""

from bumblebee.measured.importers.dataset import KINDS, import_dataset, read_rollouts

__all__ = ["KINDS", "import_dataset", "read_rollouts"]
