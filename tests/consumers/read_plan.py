"""Plans of QGroundControl, read by MAVSDK, which first needs an autopilot's heartbeat."""

import json
import socket
import threading
import unittest

import mavsdk
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError
from pymavlink import mavutil, mavwp

from exports import routes

MAV = mavutil.mavlink


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Plans(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        port = free_port()
        cls.over = threading.Event()

        def beat():
            link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=1)
            while not cls.over.wait(0.2):
                link.mav.heartbeat_send(
                    MAV.MAV_TYPE_QUADROTOR, MAV.MAV_AUTOPILOT_PX4, 0, 0, MAV.MAV_STATE_ACTIVE)
            link.close()

        cls.heart = threading.Thread(target=beat)
        cls.heart.start()
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
        cls.station = mavsdk.Mavsdk(configuration)
        cls.station.add_any_connection(f"udpin://127.0.0.1:{port}")
        autopilot = cls.station.first_autopilot(20)
        assert autopilot is not None, "no heartbeat came through"
        cls.reader = MissionRaw(autopilot)

    @classmethod
    def tearDownClass(cls):
        cls.over.set()
        cls.heart.join()
        cls.station.destroy()

    def test_missions_and_fences_are_read(self):
        for route in routes():
            with self.subTest(route.name):
                read = self.reader.import_qgroundcontrol_mission(str(route.file("plan")))
                loader = mavwp.MAVWPLoader()
                count = loader.load(str(route.file("waypoints")))
                self.assertEqual(len(read.mission_items), count)
                for index, item in enumerate(read.mission_items):
                    line = loader.wp(index)
                    self.assertEqual((item.command, item.frame), (line.command, line.frame))
                    self.assertLessEqual(abs(item.x - round(line.x * 1e7)), 1)
                    self.assertLessEqual(abs(item.y - round(line.y * 1e7)), 1)
                    self.assertAlmostEqual(item.z, line.z, delta=1e-3)
                self.assertEqual(len(read.geofence_items), fence_items(route))
                self.assertEqual(read.rally_items, [])

    def test_circles_keep_their_radius(self):
        for route in routes():
            read = self.reader.import_qgroundcontrol_mission(str(route.file("plan")))
            circles = [
                item for item in read.geofence_items
                if item.command == MAV.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION]
            threats = [threat for threat in fenced(route) if threat["kind"] == "cylinder"]
            self.assertEqual([item.param1 for item in circles], [threat["radius"] for threat in threats])
            for item, threat in zip(circles, threats):
                self.assertLessEqual(abs(item.x - threat["center"]["lat"] * 1e7), 1)
                self.assertLessEqual(abs(item.y - threat["center"]["lon"] * 1e7) % 3_600_000_000, 1)

    def test_every_altitude_frame_is_read(self):
        for route in routes():
            for altitude, frame in (("relative", 3), ("absolute", 0), ("terrain", 10)):
                with self.subTest(f"{route.name} {altitude}"):
                    file = str(route.file(f"{altitude}.qgc"))
                    read = self.reader.import_qgroundcontrol_mission(file)
                    frames = {item.frame for item in read.mission_items if item.command != 178}
                    self.assertEqual(frames, {frame})

    def test_missions_for_ardupilot_are_read_by_the_mission_planner_reader(self):
        for route in routes():
            with self.subTest(route.name):
                read = self.reader.import_mission_planner_mission(str(route.file("absolute.wpl")))
                plan = self.reader.import_qgroundcontrol_mission(str(route.file("absolute.qgc")))
                where = lambda items: [(item.x, item.y) for item in items if item.command == 16]
                # The first line is the home position.
                ways = where(read.mission_items)[-len(where(plan.mission_items)):]
                for one, other in zip(ways, where(plan.mission_items)):
                    self.assertLessEqual(abs(one[0] - other[0]), 1)
                    self.assertLessEqual(abs(one[1] - other[1]), 1)

    def test_the_reader_refuses_an_incomplete_plan(self):
        plan = json.loads(routes()[0].file("plan").read_text())
        del plan["geoFence"]
        with self.assertRaises(MissionRawError):
            self.reader.import_qgroundcontrol_mission_from_string(json.dumps(plan))


def fenced(route):
    """Threats that a fence without height can represent."""
    plan = json.loads(route.file("plan").read_text())
    without = {left["threat"] for left in plan["noctule"]["threats_without_fence"]}
    threats = enumerate(route.scenario["threats"])
    return [threat for index, threat in threats if index not in without]


def fence_items(route):
    """One item per circle, one per corner of a polygon; where a side crosses 180 degrees, each part has a corner there."""
    return sum(1 if threat["kind"] == "cylinder" else corners(threat["vertices"]) for threat in fenced(route))


def corners(vertices):
    sides = zip(vertices, vertices[1:] + vertices[:1])
    return len(vertices) + 2 * sum(abs(a["lon"] - b["lon"]) > 180 for a, b in sides)


if __name__ == "__main__":
    unittest.main()
