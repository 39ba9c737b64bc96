"""`rigidimeter design`: what will be commanded, and what will come of it, before any hardware."""

from rigidimeter.cli.design.command import design
from rigidimeter.cli.design.document import SCHEMA

__all__ = ["SCHEMA", "design"]
