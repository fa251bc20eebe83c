"""The files of deploy/: which containers there are, and how each runs the program."""

import json
import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
NOCTULE = os.environ["NOCTULE_BIN"]
NATS_SERVER = os.environ["NATS_SERVER_BIN"]

DOCKERFILE = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")


def read(path):
    """All documents of a YAML file below deploy/."""
    return [document for document in yaml.safe_load_all((DEPLOY / path).read_text()) if document]


COMPOSE = read("compose.yaml")[0]
RESOURCES = [
    resource for name in read("kubernetes/kustomization.yaml")[0]["resources"] for resource in read(f"kubernetes/{name}")
]


def of_kind(kind):
    return [resource for resource in RESOURCES if resource["kind"] == kind]


def instruction(name):
    """The arguments of the last such instruction in the Dockerfile."""
    return re.findall(rf"^{name} +(.*)$", DOCKERFILE, re.MULTILINE)[-1]


IMAGE_COMMAND = json.loads(instruction("CMD"))
IMAGE_VARIABLES = {
    name: value
    for words in re.findall(r"^ENV +(.*)$", DOCKERFILE, re.MULTILINE)
    for name, value in re.findall(r"(\S+)=(\S+)", words)
}
IMAGE_HEALTHCHECK = json.loads(instruction("HEALTHCHECK").partition("CMD ")[2])
IMAGE_PORT = int(instruction("EXPOSE"))
IMAGE_USER = int(instruction("USER").split(":")[0])


@dataclass
class Node:
    """A container that runs the program."""

    name: str
    arguments: list
    variables: dict
    # Seconds from the stop request to the kill, and how many of them pass before the process is notified.
    patience_s: float
    before_s: float

    def call(self, *arguments, **variables):
        """Runs the program with these arguments in the container's environment."""
        environment = {"PATH": os.environ["PATH"], "HOME": "/nowhere"} | IMAGE_VARIABLES | self.variables | variables
        return subprocess.run([NOCTULE, *arguments], env=environment, capture_output=True, text=True, check=False)

    def settings(self):
        """The settings that `--print-config` shows, each with its source."""
        printed = self.call(*self.arguments, "--print-config")
        if printed.returncode != 0:
            raise AssertionError(f"{self.name}: {printed.stderr}")
        lines = re.findall(r"^(\w+) = (.*) # (.*)$", printed.stdout, re.MULTILINE)
        return {key: (value.strip("\"'"), source) for key, value, source in lines}


def seconds(text):
    number, unit = re.fullmatch(r"(\d+)(s|m)", text).groups()
    return int(number) * {"s": 1, "m": 60}[unit]


def compose_nodes():
    for name, service in COMPOSE["services"].items():
        if service["image"] == "noctule":
            yield Node(
                f"compose {name}",
                service.get("command", IMAGE_COMMAND),
                service["environment"],
                seconds(service["stop_grace_period"]),
                0,
            )


def pods():
    """Workloads with their pod templates."""
    for resource in of_kind("Deployment") + of_kind("StatefulSet"):
        yield resource, resource["spec"]["template"]


def pod_nodes():
    maps = {resource["metadata"]["name"]: resource["data"] for resource in of_kind("ConfigMap")}
    for workload, pod in pods():
        for container in pod["spec"]["containers"]:
            if container["image"] != "noctule":
                continue
            variables = {}
            for source in container.get("envFrom", []):
                variables |= maps[source["configMapRef"]["name"]]
            for variable in container.get("env", []):
                # From a secret that need not exist.
                if "value" in variable:
                    variables[variable["name"]] = variable["value"]
                else:
                    assert variable["valueFrom"]["secretKeyRef"]["optional"], variable
            pause = container.get("lifecycle", {}).get("preStop", {}).get("sleep", {}).get("seconds", 0)
            patience_s = pod["spec"]["terminationGracePeriodSeconds"]
            yield Node(workload["metadata"]["name"], container["args"], variables, patience_s, pause)


NODES = [*compose_nodes(), *pod_nodes()]
