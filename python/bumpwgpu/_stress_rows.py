"""Rows of the stress table: what was checked, the worst value found, and where."""

from __future__ import annotations

from typing import Any

__all__ = ["Check", "failed", "row"]

Check = dict[str, Any]


def row(name: str, worst: float, unit: str, limit: float, where: str) -> Check:
    """One check; it is passed when the worst value is within the limit."""
    return {
        "check": name,
        "worst": float(worst),
        "unit": unit,
        "limit": float(limit),
        "passed": bool(worst <= limit),
        "where": where,
    }


def failed(name: str, what: str) -> Check:
    """A check that could not be made, because of an error."""
    return row(name, float("inf"), "errors", 0.0, what)
