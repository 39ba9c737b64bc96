"""What the operator sees and says while the rig runs."""

from rigidimeter.console.terminal import KEYS, Terminal

__all__ = ["KEYS", "Terminal"]
