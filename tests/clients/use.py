"""The client that openapi-python-client makes: everything that it declares is read and sent as the service does."""

import io
import os
import pathlib
import unittest

import noctule_client.models as models
from noctule_client.api.plans import (cancel_plan, convert_scenario, delete_plan, get_plan, get_result, get_scenario,
                                      issue_ticket, list_plans, submit_plan)
from noctule_client.api.service import (get_limits, get_shipped_scenario, list_algorithms, list_scenarios,
                                        sample_ground)
from noctule_client.api.terrains import get_terrain, list_terrains, put_terrain, sample_terrain
from noctule_client.client import Client
from noctule_client.types import File

CLIENT = Client(base_url=os.environ["NOCTULE_URL"])
JACKSBORO = pathlib.Path(__file__).parents[2] / "scenarios/terrain/jacksboro.tif"
LEAST = {"start": {"x": 0, "y": 0, "z": 50}, "target": {"x": 1000, "y": 0, "z": 50}, "altitude": {"min": 0, "max": 100}}
GROUNDS = [
    {"kind": "flat", "elevation": -5.0},
    {"kind": "peaks", "base": 0.0, "peaks": [{"center": {"x": 500, "y": 200}, "height": 30, "spread": {"x": 80, "y": 90}}]},
    {"kind": "grid", "origin": {"x": -100, "y": -500}, "cell": 600, "columns": 3, "rows": 3, "elevations": [0] * 9},
]


def scenario(**fields):
    planner = {"waypoints": 3, "population": 20, "iterations": 20, "parameters": {"quadrature": "paper", "f_max": 1.5}}
    return models.Scenario.from_dict({**LEAST, "planner": planner, **fields})


def ask(operation, *ids, **arguments):
    answer = operation.sync_detailed(*ids, client=CLIENT, **arguments)
    assert answer.status_code < 300, answer.content
    return answer.parsed


def tearDownModule():
    CLIENT.get_httpx_client().close()


class GeneratedClient(unittest.TestCase):
    def test_a_plan_from_submission_to_deletion(self):
        # A seed that the server draws has up to 53 bits.
        plan = ask(submit_plan, body=scenario(), prefer="wait=30")
        self.assertEqual(plan.status, "succeeded")
        self.assertGreater(plan.evaluations, 0)
        self.assertEqual(ask(get_plan, plan.id).seed, plan.seed)
        self.assertIn(plan.id, [listed.id for listed in ask(list_plans).plans])

        result = ask(get_result, plan.id)
        self.assertEqual(result.seed, plan.seed)
        self.assertEqual(result.cost.total, plan.best_cost)
        self.assertEqual((result.waypoints[0].x, result.waypoints[-1].x), (0, 1000))
        self.assertTrue(ask(issue_ticket, plan.id).ticket)
        ask(cancel_plan, plan.id)
        ask(delete_plan, plan.id)
        self.assertIsInstance(get_plan.sync_detailed(plan.id, client=CLIENT).parsed, models.Problem)

    def test_grounds_and_threats_keep_their_kind(self):
        threats = [{"kind": "cylinder", "center": {"x": 400, "y": 10}, "radius": 50},
                   {"kind": "polygon", "vertices": [{"x": 700, "y": 100}, {"x": 800, "y": 100}, {"x": 750, "y": 200}]}]
        for ground in GROUNDS:
            plan = ask(submit_plan, body=scenario(terrain=ground, threats=threats), prefer="wait=30")
            accepted = ask(get_scenario, plan.id).to_dict()
            self.assertEqual({key: accepted["terrain"][key] for key in ground}, ground)
            self.assertEqual([threat["kind"] for threat in accepted["threats"]], ["cylinder", "polygon"])

    def test_shipped_scenarios_are_read_and_sent_as_they_are(self):
        for shipped in ask(list_scenarios).scenarios:
            document = ask(get_shipped_scenario, shipped.name)
            self.assertTrue(ask(submit_plan, body=document, validate_only=True).valid, shipped.name)
        self.assertGreater(len(ask(sample_ground, body=ask(get_shipped_scenario, "paper-4")).elevations), 1)

    def test_a_dataset(self):
        dataset = ask(put_terrain, "clients", body=File(payload=io.BytesIO(JACKSBORO.read_bytes())))
        self.assertEqual(ask(get_terrain, "clients").sha256, dataset.sha256)
        self.assertIn("clients", [listed.name for listed in ask(list_terrains).terrains])
        self.assertGreater(len(ask(sample_terrain, "clients").elevations), 1)

    def test_what_the_service_allows_and_offers(self):
        self.assertGreater(ask(get_limits).work, 2**31)
        algorithms = ask(list_algorithms).algorithms
        self.assertEqual(algorithms[0].name, "tms-sba")

    def test_a_conversion(self):
        features = [{"type": "Feature", "properties": {"name": name}, "geometry": {"type": "Point", "coordinates": place}}
                    for name, place in [("start", [8.5456, 47.3977, 540]), ("target", [8.5623, 47.405, 580])]]
        body = models.JsonObject.from_dict({"type": "FeatureCollection", "features": features})
        self.assertEqual(ask(convert_scenario, body=body).scenario["frame"], "wgs84")

    def test_all_faults_of_a_scenario(self):
        refused = submit_plan.sync_detailed(client=CLIENT, body=scenario(altitude={"min": 50, "max": 20}))
        self.assertEqual((refused.status_code, refused.parsed.errors[0].pointer), (422, "/altitude"))
