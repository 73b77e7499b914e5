"""Optimal experiment design: the sensor, duration and rate that would sharpen the parameter that is known worst."""

from shoal.identification.design.asked import SENSORS
from shoal.identification.design.plan import ABOUT, Design, about_answer, about_start, design, has_data
from shoal.identification.design.sensors import Sensor

__all__ = ["ABOUT", "SENSORS", "Design", "Sensor", "about_answer", "about_start", "design", "has_data"]
