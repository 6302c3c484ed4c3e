"""Compares a picture of examples/cpp with the one that stands next to its example.

Devices round differently: the colours of cells may differ a little, and marks by half a cell.
"""

import re
import sys


def parts_of(path):
    """The head of the picture, the step of every coloured cell, and the numbers of its marks."""
    with open(path) as file:
        text = file.read()
    cells = {}
    for red, green, blue, d in re.findall(r'<path fill="rgb\((\d+),(\d+),(\d+)\)" d="(.*)"/>', text):
        for x, y in re.findall(r"M(\d+) (\d+)h1v1h-1z", d):
            cells[int(x), int(y)] = (int(red), int(green), int(blue))
    marks = [[float(number) for number in circle]
             for circle in re.findall(r'<circle cx="(\S+)" cy="(\S+)" r="(\S+)"', text)]
    return text.split("\n")[0], cells, marks


def main():
    made, stored = sys.argv[1:]
    head, cells, marks = parts_of(made)
    stored_head, stored_cells, stored_marks = parts_of(stored)
    white = (255, 255, 255)
    places = set(cells) | set(stored_cells)
    difference = sum(
        abs(a - b) for place in places
        for a, b in zip(cells.get(place, white), stored_cells.get(place, white)))
    same = (
        head == stored_head
        and len(marks) == len(stored_marks) > 0
        and all(abs(a - b) < 0.5 for mark, other in zip(marks, stored_marks)
                for a, b in zip(mark, other))
        and difference < 2.0 * 3 * len(places))
    if not same:
        print(f"{made} differs from {stored}; look at both, and copy the first if it is right")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
