"""How schemathesis reads what it does not know by itself."""

import json
from pathlib import Path

import schemathesis

# As good as any for a plan of which there was nothing more to tell.
END = {"id": 1, "event": "end", "data": {"status": "succeeded", "result": None}}


@schemathesis.deserializer("application/x-ndjson")
def lines(_, response):
    """The description says what a line is. Every one must be JSON; one of them is held to it, another for another answer."""
    events = [json.loads(line) for line in response.content.splitlines() if line] or [END]
    return events[len(response.content) % len(events)]


def names(file):
    return [json.loads(line) for line in Path(file).read_text().splitlines()]


# What seed.py wrote: plans and datasets that others are to find, and those that are there to be deleted.
SEEDED = {*names("plans"), *names("datasets")}
SPARE = {"id": names("spare-plans"), "name": names("spare-datasets")}


@schemathesis.hook
def before_call(_, case, kwargs):
    """Deletes only what requests made, and what is there for it."""
    if case.method.upper() == "DELETE":
        for name, value in (case.path_parameters or {}).items():
            if value in SEEDED:
                case.path_parameters[name] = SPARE[name].pop() if SPARE[name] else "another"
