"""Prints the slowest tests of a report in JUnit's format, which cargo-nextest and pytest write.

    slowest.py REPORT [--n 20]
"""

import argparse
import xml.etree.ElementTree as xml


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("report")
    parser.add_argument("--n", type=int, default=20)
    options = parser.parse_args()
    cases = [(float(case.get("time")), f"{case.get('classname')} {case.get('name')}") for case in xml.parse(options.report).iter("testcase")]
    total_s = sum(time_s for time_s, _ in cases)
    print(f"{len(cases)} tests, {total_s:.0f} s in all; the slowest:")
    for time_s, name in sorted(cases, reverse=True)[: options.n]:
        print(f"{time_s:8.1f} s  {name}")


if __name__ == "__main__":
    main()
