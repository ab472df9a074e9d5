"""Measures the rows of units.toml and holds them against what they must reach. Called by run.sh; see there."""

import concurrent.futures
import json
import os
import pathlib
import sys

import flow
import report
import units

HERE = pathlib.Path(__file__).parent
RESULTS = HERE / "results.json"


def load():
    """What was measured, by row; another run may have added to it."""
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def stale(row, results):
    """Whether a row is missing or was made from other sources."""
    return results.get(row.key, {}).get("hash") != row.hash()


def chosen(arguments, rows, results):
    """The rows that the command line asks for."""
    if arguments == ["--smoke"]:
        return [row for row in rows if row.config in row.unit.get("smoke", [])]
    if arguments == ["--all"]:
        return rows
    if not arguments:
        return [row for row in rows if stale(row, results)]
    wanted = [row for row in rows if {row.key, row.name} & set(arguments)]
    unknown = set(arguments) - {row.key for row in wanted} - {row.name for row in wanted}
    if unknown:
        sys.exit(f"syn: not in units.toml: {' '.join(sorted(unknown))}")
    return wanted


def unknown_rows(results, rows):
    """Sentences about results of what is no longer listed."""
    known = {row.key for row in rows}
    return [f"{key}: has a result, but no configuration; remove it" for key in results if key not in known]


def main():
    """Exits with 1 if a result is wrong."""
    arguments = sys.argv[1:]
    rows = units.rows()
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    if arguments == ["--list"]:
        for row in rows:
            age = "not measured" if row.key not in results else "changed since" if stale(row, results) else "current"
            print(f"{row.key:24} {age}")
        sys.exit(1 if unknown_rows(results, rows) else 0)

    smoke = arguments == ["--smoke"]
    wrong = unknown_rows(results, rows) if smoke else []
    measured = {}
    work = chosen(arguments, rows, results)
    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS", os.cpu_count()))) as pool:
        jobs = {pool.submit(flow.measure, row): row for row in work}
        for job in concurrent.futures.as_completed(jobs):
            row = jobs[job]
            try:
                measured[row.key] = job.result()
            except flow.Failed as failure:
                wrong.append(f"{row.key}: {failure}")
                continue
            wrong += row.misses(measured[row.key])
            if not smoke:
                # After each one: they take long.
                found = load() | measured
                results = {row.key: found[row.key] for row in rows if row.key in found}
                RESULTS.write_text(json.dumps(results, indent=1) + "\n")

    shown = [row for row in rows if row.key in (measured if smoke else results)]
    text = report.text(shown, measured if smoke else results)
    if smoke:
        print(text)
        for row in rows:
            if row.key in results and stale(row, results):
                print(f"syn: {row.key}: RESULTS.md has it from other sources than these")
        if (HERE / "RESULTS.md").read_text() != report.text([r for r in rows if r.key in results], results):
            wrong.append("RESULTS.md is not what results.json says: run fpga/syn/run.sh heap/small")
    else:
        (HERE / "RESULTS.md").write_text(text)
    for sentence in wrong:
        print(f"syn: {sentence}", file=sys.stderr)
    print(f"syn: {len(measured)} placed and routed, {len(wrong)} wrong; passed" if not wrong else "syn: FAILED")
    sys.exit(1 if wrong else 0)


main()
