"""Known layouts of logs, read as rollouts of the contract."""

from bumblebee.measured.importers.dataset import KINDS, import_dataset, read_rollouts
from bumblebee.measured.importers.notes import notes_of

__all__ = ["KINDS", "import_dataset", "notes_of", "read_rollouts"]
