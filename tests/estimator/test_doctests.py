"""The examples in the docstrings are true."""

import doctest
import importlib
import pkgutil

import pytest

import estimator

MODULES = [module.name for module in pkgutil.iter_modules(estimator.__path__, "estimator.")]


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_there_are_examples():
    found = [doctest.DocTestFinder().find(importlib.import_module(name)) for name in MODULES]
    assert sum(len(test.examples) for tests in found for test in tests) > 10
