"""Localization and mapping on robots that others drove, by the codelets that drive the town."""
