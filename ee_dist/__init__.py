"""Robots that find out what is wrong with themselves."""

from ee_dist.basics.arithmetic import pin

pin()
