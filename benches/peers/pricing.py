"""`noctule bench price` as a function from routes to violations and costs."""

import json
import os
import subprocess

# One metre or degree of violation outweighs any cost that a search could save by it.
PENALTY = 1e4


def binary():
    return os.environ.get("NOCTULE_BIN", "target/release/noctule")


class Pricer:
    """Prices positions of a coding, counts them, stops after `budget`, and keeps the best."""

    def __init__(self, scenario, coding, budget):
        command = [binary(), "bench", "price", str(scenario), "--above-ground"]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.coding, self.budget, self.evaluations = coding, budget, 0
        self.best = (float("inf"), float("inf"))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()

    def prices(self, positions):
        """(violation, cost) of each position; ends the search once the budget is spent."""
        if self.evaluations >= self.budget:
            raise Spent
        self.evaluations += len(positions)
        routes = [self.coding.decode([float(x) for x in position]) for position in positions]
        self.process.stdin.write(json.dumps(routes) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise SystemExit(f"benches/peers: {binary()} bench price ended, see above")
        prices = [tuple(price) for price in json.loads(answer)]
        self.best = min(self.best, *prices)
        return prices

    def objective(self, position):
        violation, cost = self.prices([position])[0]
        return cost + PENALTY * violation


class Spent(Exception):
    """All evaluations have been used."""
