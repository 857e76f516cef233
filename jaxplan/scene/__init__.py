"""An MJCF as planning sees it: arm joints, limits, movable objects, contacts."""

from jaxplan.scene.contacts import Contact as Contact
from jaxplan.scene.contacts import Geoms as Geoms
from jaxplan.scene.contacts import find_contacts as find_contacts
from jaxplan.scene.contacts import geom_pairs as geom_pairs
from jaxplan.scene.dependent import Dependent as Dependent
from jaxplan.scene.excludes import Excluded as Excluded
from jaxplan.scene.links import Link as Link
from jaxplan.scene.numbers import Numbers as Numbers
from jaxplan.scene.scene import Scene as Scene
from jaxplan.scene.structure import Group as Group
from jaxplan.scene.structure import Slot as Slot
from jaxplan.scene.structure import Structure as Structure
from jaxplan.scene.structure import movers as movers
from jaxplan.scene.structure import only_line as only_line
