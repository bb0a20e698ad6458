#!/usr/bin/env python3
"""Makes docs/reliability.md: reliability_page.py FAULTS.json KEPT.jsonl NEW.jsonl

FAULTS are the rows of the table, NEW what the tests said just now, KEPT what they said last. What a
test says of a row in NEW takes the place of all that it said of it before; KEPT is written anew.
A test that could not run says why; that counts for rows of which it never said anything else.
"""
import json
import os
import sys


def lines(path):
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file]


def main(faults_path, kept_path, new_path):
    with open(faults_path, encoding="utf-8") as file:
        faults = json.load(file)
    new = lines(new_path)
    told = {(f["row"], f["test"]) for f in new if "skipped" not in f}
    rows = {row for row, _ in told}
    kept = [f for f in lines(kept_path)
            if ((f["row"], f["test"]) not in told if "test" in f else f["row"] not in rows)]
    figures = kept + [f for f in new if "skipped" not in f]
    shown = rows | {f["row"] for f in kept}
    skipped = {f["row"]: f["skipped"] for f in new if "skipped" in f and f["row"] not in shown}
    figures.sort(key=lambda figure: (figure["row"], figure["what"]))
    with open(kept_path, "w", encoding="utf-8") as file:
        for figure in figures:
            file.write(json.dumps(figure) + "\n")

    print("# Reliability\n")
    print("The faults that a farm must survive, and what the tests of each reached. Made by\n"
          "`bash docs/make_reliability.sh`; no figure is typed by hand. *Golden* is the store that one\n"
          "worker makes without faults; *identical* means equal to it byte for byte.\n")
    missing = []
    section = None
    for fault in faults:
        if fault.get("section", "") != section:
            section = fault.get("section", "")
            head = "what" if section else "fault"
            print((f"\n## {section}\n\n" if section else "") +
                  f"| # | {head} | asked | reached | counts |\n|---|---|---|---|---|")
        mine = [f for f in figures if f["row"] == fault["row"]]
        if not mine:
            missing.append(fault["row"])
        reached = "<br>".join(
            f'{"" if f["held"] else "**missed** "}{f["what"]}: {f["reached"]} (asked {f["asked"]})'
            for f in mine)
        counts = "" if not mine else "full" if all(f["full"] for f in mine) else "reduced"
        if fault["row"] in skipped:
            reached = "not run here: " + skipped[fault["row"]]
        print(f'| {fault["row"]} | {fault["fault"]} | {fault["asked"]} | '
              f'{reached or "not run here"} | {counts} |')
    if missing:
        print(f'\nWithout a figure yet: rows {", ".join(map(str, missing))}.')


if __name__ == "__main__":
    main(*sys.argv[1:])
