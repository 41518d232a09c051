"""The arm of three joints as a model file."""

from pathlib import Path

from tests.measured.simulated import ARM, ARM_JOINTS


def model_file(folder: Path) -> Path:
    lines = "".join(f'<position name="{name}" joint="{name}" kp="40" kv="2"/>' for name in ARM_JOINTS)
    path = folder / "arm.xml"
    path.write_text(ARM.replace("ACTUATORS", lines))
    return path
