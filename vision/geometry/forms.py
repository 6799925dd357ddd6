"""The forms of object that a whisker may touch, by the names that manifests give them."""

from vision.geometry.cone import Cone
from vision.geometry.ring import Ring
from vision.geometry.rods import Bar
from vision.geometry.sphere import Sphere
from vision.geometry.touched import StatedSizes, Touched

FORMS: dict[str, type[Touched]] = {form.name: form for form in (Bar, Ring, Sphere, Cone)}


def touched_object(form: str, stated: StatedSizes) -> Touched:
    """Return the object of that form and of stated sizes.

    Raises Refused where it cannot have these sizes.
    """
    return FORMS[form].from_sizes(stated)
