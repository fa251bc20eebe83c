"""QGC WPL 110, read by pymavlink."""

import math
import unittest

from pymavlink import mavutil, mavwp

from exports import off, routes

MAV = mavutil.mavlink


def load(file):
    loader = mavwp.MAVWPLoader()
    count = loader.load(str(file))
    return [loader.wp(index) for index in range(count)]


class Waypoints(unittest.TestCase):
    def test_px4_mission_starts_with_a_takeoff_and_ends_with_a_landing(self):
        for route in routes():
            with self.subTest(route.name):
                items = load(route.file("waypoints"))
                commands = [item.command for item in items]
                self.assertEqual(commands[0], MAV.MAV_CMD_NAV_TAKEOFF)
                self.assertEqual(commands[1], MAV.MAV_CMD_DO_CHANGE_SPEED)
                self.assertEqual(commands[-1], MAV.MAV_CMD_NAV_LAND)
                self.assertEqual(set(commands[2:-1]), {MAV.MAV_CMD_NAV_WAYPOINT})
                self.assertEqual([item.current for item in items], [1] + [0] * (len(items) - 1))
                yaws = [item.param4 for item in items if item.command != MAV.MAV_CMD_DO_CHANGE_SPEED]
                self.assertTrue(all(map(math.isnan, yaws)))
                target = route.path("msl")[-1]
                for item in items[-2:]:
                    self.assertLessEqual(off((item.y, item.x, 0), (*target[:2], 0))[0], 1e-7)

    def test_absolute_items_are_above_sea_and_near_the_path(self):
        for route in routes():
            with self.subTest(route.name):
                home, takeoff, _, *waypoints = load(route.file("absolute.wpl"))
                self.assertEqual(home.command, MAV.MAV_CMD_NAV_WAYPOINT)
                path = route.path("msl")
                for item in (home, takeoff):
                    self.assertLessEqual(off((item.y, item.x, 0), (*path[0][:2], 0))[0], 1e-7)
                for item in waypoints:
                    self.assertEqual(item.frame, MAV.MAV_FRAME_GLOBAL)
                    apart = [off((item.y, item.x, item.z), point) for point in path]
                    # A metre to the side of the path, in degrees of longitude at 70 degrees north.
                    self.assertTrue(any(d <= 3e-5 and m <= 1.1 or d < 1e-3 and m < 10 for d, m in apart))
                self.assertLessEqual(abs(waypoints[-1].z - path[-1][2]), 2e-3)

    def test_relative_items_are_above_home(self):
        for route in routes():
            with self.subTest(route.name):
                absolute = load(route.file("absolute.wpl"))
                relative = load(route.file("relative.wpl"))
                home = absolute[0].z
                for one, other in zip(absolute[3:], relative[3:]):
                    self.assertEqual(other.frame, MAV.MAV_FRAME_GLOBAL_RELATIVE_ALT)
                    self.assertAlmostEqual(one.z - home, other.z, delta=2e-3)

    def test_terrain_items_are_within_the_band(self):
        for route in routes():
            band = route.scenario["altitude"]
            with self.subTest(route.name):
                for item in load(route.file("terrain.wpl"))[4:-1]:
                    self.assertEqual(item.frame, MAV.MAV_FRAME_GLOBAL_TERRAIN_ALT)
                    self.assertLessEqual(item.z, band["max"] + 1e-2)
                    self.assertGreaterEqual(item.z, band["min"] - 1e-2)
