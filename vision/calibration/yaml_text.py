"""YAML as Kalibr writes it."""

from pathlib import Path
from typing import Any

from vision.geometry.refusals import Refused


def read_yaml(path: Path) -> Any:
    """Return what a YAML file holds. Raises Refused where it is none, or PyYAML is not installed."""
    try:
        import yaml
    except ImportError:
        raise Refused(f"{path.name} needs PyYAML: pip install 'whisker-bench[yaml]'") from None
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8-sig"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        words = " ".join(str(error).split())
        raise Refused(f"{path.name} is not YAML: {words}") from None
