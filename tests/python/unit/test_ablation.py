"""The battery that switches mechanisms of the fit off: each one is there, and is back afterwards."""

import sys

import ablation
import pytest

CHANGES = {(name, i): change for name, changes in ablation.MECHANISMS.items() for i, change in enumerate(changes)}


@pytest.mark.parametrize(("name", "i"), CHANGES)
def test_a_mechanism_is_replaced_in_all_modules_and_put_back(name, i):
    change = CHANGES[name, i]
    before = vars(change.owner)[change.name]
    users = [one for one in sys.modules.values() if vars(one).get(change.name) is before and callable(before)]
    with ablation.without(name):
        assert vars(change.owner)[change.name] is not before
        assert not any(vars(one)[change.name] is before for one in users if one.__name__.startswith("jointfrf"))
    assert vars(change.owner)[change.name] is before
    assert all(vars(one)[change.name] is before for one in users)


@pytest.fixture(scope="module")
def compared():
    """One problem with and without a mechanism that is known to matter, and one that is not used by it."""
    (place,) = (i for i, one in enumerate(ablation.problems()) if one.name == "joint, 1 %, gain of each hit, 0.7 %")
    draws = {name: [ablation.drawn(name, place, i) for i in range(3)]
             for name in (None, "effects of calibration", "errors of models")}  # fmt: skip
    problem = ablation.problems()[place]
    return [
        ablation.compared(problem, draws[name], draws[None]) for name in ("effects of calibration", "errors of models")
    ]


def test_a_mechanism_that_matters_changes_widths_and_misses(compared):
    without_effects, without_model_errors = compared
    assert without_effects.width < 0.7
    assert without_effects.silent[0] >= without_effects.silent[1]
    assert without_model_errors.width == without_model_errors.rmse == 1.0


def test_errors_are_compared_in_a_coordinate_that_is_regular_from_free_to_rigid():
    problem = ablation.Problem("made up", None, lambda number: {"k_y": 0.0, "c_y": 2.0})
    draws = [ablation.Draw({"k_y": (0.0, 0.0, 1e3), "c_y": (2.1, 1.9, 2.3)}, frozenset(), 1.0) for _ in range(4)]
    worse = [one._replace(values=one.values | {"c_y": (2.2, 1.8, 2.6)}) for one in draws]
    worse[0] = worse[0]._replace(values=worse[0].values | {"k_y": (1e3, 500.0, float("inf"))})
    found = ablation.compared(problem, worse, draws)
    assert found.rmse > 2
    assert 1 < found.width <= 2
    assert found.silent == (1, 0)
