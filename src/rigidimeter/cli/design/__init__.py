"""`rigidimeter design`: what will be commanded, and what will come of it, before any hardware."""

from rigidimeter.cli.design.design_command import design
from rigidimeter.cli.design.design_json import SCHEMA

__all__ = ["SCHEMA", "design"]
