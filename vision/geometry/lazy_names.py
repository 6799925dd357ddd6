"""Names that a package offers, each imported from its module at first use."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(package: str, modules: Mapping[str, tuple[str, ...]]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package that offers names of its modules.

    modules: names by module, relative to the package. The function returned raises AttributeError
    for any other name.
    """
    module_of = {name: module for module, names in modules.items() for name in names}

    def find(name: str) -> Any:
        """Return a name of the package."""
        if name not in module_of:
            raise AttributeError(f"{package} offers no {name}")
        return getattr(import_module(f"{package}.{module_of[name]}"), name)

    return find
