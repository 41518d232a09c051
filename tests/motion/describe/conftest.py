"""A small HumanML3D, and the real one where it lies beside the repository."""

from pathlib import Path

import pytest

from tests.motion.describe.small_humanml3d import put_humanml3d


@pytest.fixture
def humanml3d(tmp_path: Path) -> Path:
    return put_humanml3d(tmp_path / "humanml3d")


@pytest.fixture(scope="session")
def shared() -> Path:
    """The real data beside the repository."""
    place = Path(__file__).parents[3].parent / "shared" / "data"
    if not (place / "text" / "humanml3d" / "texts.zip").is_file():
        pytest.skip("the shared data is not here")
    return place
