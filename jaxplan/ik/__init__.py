"""Inverse kinematics, and the poses that it is asked for."""

from jaxplan.ik.inverse import BATCH_ROUNDS as BATCH_ROUNDS
from jaxplan.ik.inverse import Limits as Limits
from jaxplan.ik.inverse import Solutions as Solutions
from jaxplan.ik.inverse import inverse_kinematics as inverse_kinematics
from jaxplan.ik.inverse import inverse_kinematics_batch as inverse_kinematics_batch
from jaxplan.ik.pose import Pose as Pose
from jaxplan.ik.pose import Region as Region
from jaxplan.ik.pose import regions as regions
