"""The commands of the files, run: a NATS server with its file, and the nodes of Compose and Kubernetes on it."""

import json
import re
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.error
import urllib.request
from pathlib import Path

from files import DEPLOY, IMAGE_HEALTHCHECK, NATS_SERVER, NOCTULE, NODES, ROOT, read

PATIENCE_S = 30


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def ask(url, document=None):
    """The status and body of the response."""
    body = None if document is None else json.dumps(document).encode()
    request = urllib.request.Request(url, body, {"content-type": "application/json"})
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as refusal:
        return refusal.code, refusal.read().decode()


def until(what, holds):
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        try:
            if holds():
                return
        except OSError:
            pass
        time.sleep(0.05)
    raise AssertionError(f"never {what}")


class Running(unittest.TestCase):
    def setUp(self):
        self.scratch = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.port, self.monitor = free_port(), free_port()
        # As in the file, but with the test's own ports and directory.
        config = (DEPLOY / "nats/nats.conf").read_text()
        for there, here in (
            ('"0.0.0.0:4222"', f'"127.0.0.1:{self.port}"'),
            ('"0.0.0.0:8222"', f'"127.0.0.1:{self.monitor}"'),
            ('"/data"', json.dumps(str(self.scratch / "nats"))),
        ):
            self.assertIn(there, config)
            config = config.replace(there, here)
        path = self.scratch / "nats.conf"
        path.write_text(config)
        self.start([NATS_SERVER, "-c", str(path)], {"SERVER_NAME": "nats"})
        health = f"http://127.0.0.1:{self.monitor}/healthz?js-enabled-only=true"
        until("healthy", lambda: ask(health)[0] == 200)

    def start(self, command, environment):
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def node(self, node, namespace):
        """Starts the node with its own command, but local paths and ports; its process and URL."""
        directory = self.scratch / f"{node.name} {time.monotonic()}"
        here = {
            "listen": "127.0.0.1:0",
            "data-dir": str(directory),
            "grace": "5",
        }
        arguments, words = [], iter(node.arguments)
        for word in words:
            flag = word.removeprefix("--").split("=")[0]
            if flag in here:
                if "=" not in word:
                    next(words)
                continue
            arguments.append(word)
        arguments += [f"--{flag}={value}" for flag, value in here.items()]
        # Three replicas would need three servers.
        variables = node.variables | {
            "NOCTULE_STORE": f"nats://127.0.0.1:{self.port}/{namespace}",
            "NOCTULE_STORE_REPLICAS": "1",
        }
        process = self.start([NOCTULE, *arguments], variables)
        url = process.stdout.readline().strip().removeprefix("listening on ")
        until(f"ready: {node.name}", lambda: ask(f"{url}/readyz")[0] == 200)
        return process, url

    def test_the_server_syncs_every_write(self):
        _, told = ask(f"http://127.0.0.1:{self.monitor}/varz")
        self.assertTrue(json.loads(told)["jetstream"]["config"]["sync_always"])

    def test_plans_accepted_by_one_node_run_on_another(self):
        scenario = json.loads((ROOT / "scenarios/paper-1.json").read_text())
        for namespace, prefix in (("compose", "compose "), ("pods", "noctule-")):
            nodes = [node for node in NODES if node.name.startswith(prefix)]
            started = {node.name.removeprefix(prefix): self.node(node, namespace) for node in nodes}
            _, api = started["api"]
            _, worker = started["worker"]
            status, plan = ask(f"{api}/plans", scenario)
            self.assertEqual(status, 202, plan)
            address = api + json.loads(plan)["links"]["self"]
            until("ended", lambda: json.loads(ask(address)[1])["status"] == "succeeded")
            self.assertEqual(ask(f"{worker}/plans", scenario)[0], 404)

            for process, url in started.values():
                command = [NOCTULE, *IMAGE_HEALTHCHECK[1:]]
                asked = subprocess.run(
                    command, env={"NOCTULE_HEALTHCHECK_URL": f"{url}/readyz"}, capture_output=True, check=False
                )
                self.assertEqual(asked.returncode, 0, asked.stderr)
                status, metrics = ask(f"{url}/metrics")
                self.assertEqual(status, 200)
                [rule] = read("kubernetes/queue-metric.yaml")[0]["rules"]["external"]
                metric = re.match(r"\w+", rule["seriesQuery"])[0]
                self.assertRegex(metrics, rf'(?m)^{metric}{{status="queued"}} ')
                process.send_signal(signal.SIGTERM)
            for process, _ in started.values():
                self.assertEqual(process.wait(timeout=PATIENCE_S), 0)


if __name__ == "__main__":
    unittest.main()
