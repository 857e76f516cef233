"""Clearance and freedom of configurations and motions, batched, on an MJX model."""

from jaxplan.collision.certify import Certificate as Certificate
from jaxplan.collision.certify import certify as certify
from jaxplan.collision.closest import closest_pair as closest_pair
from jaxplan.collision.closest import tightest_pair as tightest_pair
from jaxplan.collision.engine import XLA_OPTIONS as XLA_OPTIONS
from jaxplan.collision.margins import required_clearances as required_clearances
from jaxplan.collision.obstacles import Obstacle as Obstacle
from jaxplan.collision.oracle import clearance_mujoco as clearance_mujoco
from jaxplan.collision.programs import per_scene as per_scene
from jaxplan.collision.queries import clearance as clearance
from jaxplan.collision.queries import config_free as config_free
from jaxplan.collision.queries import motion_bound as motion_bound
from jaxplan.collision.queries import motion_free as motion_free
from jaxplan.collision.queries import pair_motion_bounds as pair_motion_bounds
from jaxplan.collision.touching import always_touching as always_touching
from jaxplan.collision.world import OWN_AXES as OWN_AXES
from jaxplan.collision.world import World as World
from jaxplan.collision.world import make_world as make_world
from jaxplan.collision.world import world_at as world_at
from jaxplan.collision.world import world_at_key as world_at_key
