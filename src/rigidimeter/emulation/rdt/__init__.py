"""An ATI network sensor on loopback."""
