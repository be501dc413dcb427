"""Fits of recorded problems end where they ended: `tests/accuracy/run guard --write` renews the records."""

from __future__ import annotations

import guard
import pytest

RECORDED = guard.recorded()
#: Processor seconds above which a problem is left to the long run.
_LONG = 0.5


def test_every_problem_is_recorded():
    assert list(RECORDED) == list(guard.PROBLEMS)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] if record.get("seconds", 0) > _LONG else [])
        for name, record in RECORDED.items()
    ],
)
def test_fit_ends_where_it_ended(name):
    assert guard.changes(name) == []


def test_a_moved_estimate_is_named():
    record = {"parameters": {"k_y": {"value": 100.0, "low": 90.0, "high": 110.0}}, "warnings": []}
    moved = {"parameters": {"k_y": {"value": 103.0, "low": 93.0, "high": 113.0}}, "warnings": ["residual-large"]}
    assert guard.differences(record, record) == []
    words = guard.differences(moved, record)
    assert words[0] == "warnings [] -> ['residual-large']"
    assert "k_y by 0.6" in words[1]


def test_a_free_dof_is_not_a_rigid_one():
    free = {"parameters": {"k_y": {"value": 100.0, "low": -5.0, "high": 110.0}}, "warnings": []}
    rigid = {"parameters": {"k_y": {"value": 100.0, "low": 90.0, "high": float("inf")}}, "warnings": []}
    assert guard.differences(rigid, free)
    assert guard.differences({"error": "ValueError"}, free)
