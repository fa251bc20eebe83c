"""Judges results of `noctule` from the definitions of cost and constraints alone, without sharing code with it.

    python3 tests/judge/judge.py --scenario SCENARIO.json --result RESULT.json [--result ...]
    python3 tests/judge/judge.py --pair DIR            every NAME.result.json beside its NAME.scenario.json

The scenario is the caller's document or the accepted one, over any terrain except datasets.
Exit status: 0 everything agrees, 1 something disagrees (each is printed with the figure claimed, the one
recomputed and the relative difference), 2 the documents cannot be judged.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

from earth import HAIR, earth_of
from report import Report
from scenario import Unsupported, load, read_scenario
from verdict import judge


def main(arguments=None):
    """Runs the command line; returns the exit status."""
    options = _options(arguments)
    try:
        batches = _batches(options)
    except (Unsupported, OSError, KeyError, TypeError, ValueError) as error:
        print(f"cannot judge: {type(error).__name__}: {error}", file=sys.stderr)
        return 2
    passed = failed = 0
    for batch in batches:
        results = []
        for scenario, file, earth in batch:
            report, result = _judge_file(scenario, file, earth)
            results.append(result)
            passed, failed = passed + report.passed, failed + (not report.passed)
            _print_report(file, report, options.quiet)
        for complaint in contradictions(batch[0][0], results):
            print(complaint)
            failed += 1
        if options.summary:
            print(summary(results))
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


def contradictions(scenario, results):
    """Lower bounds above another feasible result's total for the same scenario: no valid proof allows such a bound."""
    if scenario.paper_quadrature:
        return []
    feasible = [result for result in results if result and result.get("feasible") is True]
    try:
        best = min((result["cost"]["total"] for result in feasible), default=None)
        lowers = [result["bound"]["lower"] for result in results if result]
        return [
            f"bound.lower {lower!r} is above the total {best!r} of another result of the same scenario"
            for lower in lowers
            if best is not None and lower is not None and lower > best * (1.0 + 1e-9)
        ]
    except (KeyError, TypeError):
        return []  # return []  # already reported as a fault of that result


def summary(results):
    """One summary line for a scenario's results: how many are feasible, and their totals."""
    totals = [result["cost"]["total"] for result in results if result and result.get("feasible") is True]
    line = f"feasible {len(totals)}/{len(results)}"
    if totals:
        line += f", total mean {sum(totals) / len(totals):.4f} min {min(totals):.4f} max {max(totals):.4f}"
    return line


def _options(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", help="the scenario of every --result")
    parser.add_argument("--result", action="append", default=[], help="a result; repeatable")
    parser.add_argument("--pair", metavar="DIR", action="append", default=[], help="a directory of pairs; repeatable")
    parser.add_argument("--summary", action="store_true", help="add feasible share and totals")
    parser.add_argument("--quiet", action="store_true", help="say nothing of results that agree")
    options = parser.parse_args(arguments)
    if bool(options.scenario) != bool(options.result) or not (options.result or options.pair):
        parser.error("give --scenario with one --result or more, or --pair")
    return options


def _batches(options):
    """Lists of scenario and result file, grouped by scenario; the seed does not make a different scenario."""
    batches = []
    if options.scenario:
        document = load(options.scenario)
        batches.append([_placed(document, file) for file in options.result])
    by_document = {}
    for directory in options.pair:
        files = sorted(Path(directory).glob("*.result.json"))
        if not files:
            raise ValueError(f"{directory} holds no NAME.result.json")
        for file in files:
            document = load(file.with_name(file.name.removesuffix(".result.json") + ".scenario.json"))
            planner = {**(document.get("planner") or {}), "seed": None}
            key = json.dumps(document | {"planner": planner}, sort_keys=True)
            by_document.setdefault(key, []).append(_placed(document, str(file)))
    return batches + list(by_document.values())


def _placed(document, file):
    """The scenario of one result, the result's file, and the plane that both lie on; None in the local frame."""
    earth = earth_of(document, load(file)) if document.get("frame", "local") != "local" else None
    if earth is None:
        return read_scenario(document), file, None
    return replace(read_scenario(earth.scenario(document)), hair=HAIR), file, earth


def _judge_file(scenario, file, earth):
    """The report on one file and its document, or None when it could not be read."""
    try:
        result = load(file)
    except (OSError, ValueError) as error:
        report = Report()
        report.that(False, f"unreadable: {error}")
        return report, None
    report = judge(scenario, earth.result(result) if earth else result)
    for complaint in earth.complaints if earth else ():
        report.that(False, complaint)
    return report, result if isinstance(result, dict) else None


def _print_report(file, report, quiet):
    if report.passed and not quiet:
        print(f"{file}: agrees, {report.compared} compared")
    if not report.passed:
        print(f"{file}: {len(report.disagreements)} disagreements, {report.compared} compared")
    for disagreement in report.disagreements:
        print(f"  {disagreement}")


if __name__ == "__main__":
    sys.exit(main())
