"""The keys of [object]: a shape and its sizes, as vision takes them."""

import math
from dataclasses import fields
from typing import get_args, get_type_hints

import pytest

from bench.session.manifest import ObjectKeys, shape_of_size
from vision.geometry import StatedSizes
from vision.geometry.forms import FORMS


def test_shapes_are_the_forms_that_vision_knows():
    assert get_args(get_type_hints(ObjectKeys)["shape"]) == tuple(FORMS)
    assert set(shape_of_size().values()) <= set(FORMS)


@pytest.mark.parametrize("key", shape_of_size())
def test_a_size_that_is_stated_is_one_that_vision_takes(key):
    ((name, value),) = ObjectKeys(**{key: 20.0}).sizes.items()
    assert name in {field.name for field in fields(StatedSizes)}
    assert value == (math.radians(20.0) if name.endswith("_rad") else 20.0)


def test_a_bar_has_no_size_but_its_thickness():
    assert ObjectKeys().sizes == {}
