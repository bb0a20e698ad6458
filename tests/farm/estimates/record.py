#!/usr/bin/env python3
"""What each cell of a bake cost: record.py TRACE.json > NAME.cells

TRACE.json is that of `pvsfarm bake --trace`. A line a cell: its root and path, milliseconds of
processor time, whether it was split; roots in their order, each with what came of it. The time
left of such a bake is tested by operations_test, which says how the bakes kept here were made.
"""
import json
import sys


def main(path):
    cells = []
    with open(path, encoding="utf-8") as file:
        for event in json.load(file):
            if event["ph"] == "X":
                cells += event["args"].get("cells", [])
    for cell in sorted(cells, key=lambda c: [int(n) for n in c["cell"].split("/")]):
        print(f'{cell["cell"]} {cell["cpu_ms"]:.2f} {int(cell["split"])}')


if __name__ == "__main__":
    main(*sys.argv[1:])
