#!/usr/bin/python3
"""Compares the symbols that a shared library exports with the recorded ones and the headers.

The recorded list is the library's ABI: a symbol that goes, or whose signature changes, breaks
programs (docs/embedding.md says when that may happen). Prints every difference.
"""

import argparse
import pathlib
import re
import subprocess
import sys


def symbols(nm, file, kinds, *flags):
    """Demangled names of what a file defines, of these kinds as nm prints them."""
    text = subprocess.run(
        [nm, "--demangle", "--defined-only", *flags, file],
        check=True, capture_output=True, text=True).stdout
    found = re.findall(rf"^[0-9a-f]+ [{kinds}] (.+)$", text, re.MULTILINE)
    return {re.sub(r"@@?PALPATE_\S+$", "", name) for name in found}


def public_names(headers):
    """Classes and functions that the headers declare outside of classes."""
    names = set()
    for header in headers:
        text = header.read_text()
        names.update(re.findall(r"^(?:class|struct) (?:PALPATE_API )?(\w+)[^;]*\{", text,
                                re.MULTILINE))
        names.update(re.findall(r"^(?!inline|constexpr|#|//)\S[^=;{}()]*?\b(\w+)\(", text,
                                re.MULTILINE))
    return names


def bare(signature):
    """A signature without const and all scopes but std, which headers and nm write differently."""
    return re.sub(r"\b(?:(?!std\b)\w+::)+|\bconst | const\b", "", signature)


def hidden_members(headers):
    """How members begin that the headers mark as the library's own: their name and, of a constructor
    or an overload among others, the first type that they take."""
    return tuple(bare(name) for header in headers for name in re.findall(
        r"^ .*PALPATE_LOCAL [\w&: ]*?(\w+(?=;)|\w+\((?:const )?[\w:]*(?:<[\w: ]*)?)",
        header.read_text(), re.MULTILINE))


class Declared:
    """What public headers declare."""

    def __init__(self, headers):
        self.names = public_names(headers)
        self.hidden = hidden_members(headers)

    def has(self, symbol, pattern):
        """Whether the symbol is of this pattern, whose first group is a public name or an operator,
        and no member that the headers keep to the library."""
        match = re.match(pattern, symbol)
        member = re.match(r"palpate::\w+::(.*)", symbol)
        return (match is not None
                and (match[1] in self.names or match[1].startswith("operator"))
                and not (member and bare(member[1]).startswith(self.hidden)))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nm", default="nm")
    parser.add_argument("--shared", required=True)
    parser.add_argument("--archive", required=True)
    parser.add_argument("--list", required=True, type=pathlib.Path)
    parser.add_argument("folders", nargs="+", type=pathlib.Path, help="of the public headers")
    options = parser.parse_args()

    # All but A, which is the version's own node.
    exported = symbols(options.nm, options.shared, "B-Zu-w", "--dynamic")
    recorded = set(options.list.read_text().splitlines())
    headers = [header for folder in options.folders for header in folder.glob("*.hpp")]
    # Every program has a copy of what weak symbols (W) define.
    archive = symbols(options.nm, options.archive, "T", "--extern-only")
    faults = [f"new, add it to {options.list.name}: {s}" for s in exported - recorded]
    faults += [f"gone: {s}" for s in recorded - exported]
    declared = Declared(headers)
    faults += [f"public, but without PALPATE_API: {s}" for s in archive - exported
               if declared.has(s, r"palpate::(\w+)(?:::~?\w+)?[(\[]")]
    faults += [f"exported, but in no public header: {s}" for s in exported
               if not declared.has(s, r"(?:vtable for |typeinfo (?:name )?for )?"
                                      r"palpate::(operator\W|\w+)")]
    # A program may link the archive beside libvulkan or beside a volk of its own.
    defined = symbols(options.nm, options.archive, "A-TV-Z", "--extern-only")
    faults += [f"another library's name: {s}" for s in defined if re.match("vk[A-Z]|volk[A-Z]", s)]
    if not recorded:
        faults.append(f"{options.list} is empty")
    print(*sorted(faults), sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
