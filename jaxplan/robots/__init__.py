"""Robots that the learned half knows; a second one is a second folder and a line here."""

from jaxplan.robots.panda import PANDA as PANDA
from jaxplan.robots.robot import Gripper as Gripper
from jaxplan.robots.robot import HandChain as HandChain
from jaxplan.robots.robot import JointLimits as JointLimits
from jaxplan.robots.robot import Mount as Mount
from jaxplan.robots.robot import Robot as Robot

ROBOTS = {robot.name: robot for robot in (PANDA,)}
