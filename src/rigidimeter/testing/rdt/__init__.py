"""An emulated ATI Net F/T sensor."""
