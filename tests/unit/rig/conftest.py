"""Sessions of these tests are replayed."""

from tests.replayed import sessions_replayed

__all__ = ["sessions_replayed"]
