#!/usr/bin/env bash
# Builds the Python module with other interpreters, CPython 3.10 or later, and runs its tests with each
# as an installed module. Run by hand:
#   tests/python/other_interpreters.sh PYTHON...
# Needs the Debian packages of `./dev test`, each interpreter's headers, the network for the packages
# that pyproject.toml pins, and some minutes for each interpreter. The folder build-interpreters/
# keeps the environments. Exits with 77 where the test cannot run.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

skip() {
  echo "skipped: $*" >&2
  exit 77
}
[ $# -gt 0 ] || skip "no interpreter is named: tests/python/other_interpreters.sh PYTHON..."
for python in "$@"; do
  "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' || skip "$python is no Python 3.10 or later"
  "$python" -c 'import ensurepip, sqlite3, ssl' 2>/dev/null || skip "$python has no ensurepip, sqlite3 or ssl"
done

for python in "$@"; do
  version=$("$python" -c 'import platform; print(platform.python_version())')
  folder=$PWD/build-interpreters/$version
  echo "CPython $version:"
  rm -rf "$folder"
  "$python" -m venv "$folder"
  "$folder/bin/python" -m pip install --quiet --disable-pip-version-check '.[test]'
  # The module is the installed one. The tests send Ctrl-C, which a shell has its background ignore.
  env --default-signal=INT -u PYTHONPATH PALPATE_VALIDATION=1 PALPATE_DEVICE=llvmpipe \
    MPLBACKEND=agg PYTHONDONTWRITEBYTECODE=1 PALPATE_COMMAND="$folder/bin/palpate" \
    "$folder/bin/python" -m pytest -q -p no:cacheprovider
done
