#!/usr/bin/env bash
# Installs the Debian packages in a fresh Debian 12, builds the consumer project there against the
# installed headers and libraries, and recognises a letter with the command and in Python. Run by hand,
# as root, after `./dev deb`:
#   tests/packages/run.sh [FOLDER OF .deb FILES]
# Needs debootstrap, the network, about 3 GB in $TMPDIR, and some minutes. Exits with 77 where the
# test cannot run.
# Commands of the new root stand in single quotes, so that this shell expands nothing in them.
# shellcheck disable=SC2016
set -euo pipefail

source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
packages=${1:-$source/build-deb}

# shellcheck source=tests/packages/root.sh
. "$source/tests/packages/root.sh"
require_debootstrap
compgen -G "$packages/*.deb" >/dev/null || {
  echo "$packages holds no packages: run ./dev deb" >&2
  exit 2
}

make_root --variant=minbase
root_environment=(PALPATE_DEVICE=llvmpipe)

echo 'Dpkg::Use-Pty "0";' >"$root/etc/apt/apt.conf.d/99no-terminal"
mkdir "$root/packages"
cp "$packages"/*.deb "$root/packages"
cp -r "$source/tests/consumer/project" "$root/consumer"
in_root apt-get update -qq

echo "The command alone, with what it recommends:"
in_root sh -c 'apt-get install -y -qq /packages/libpalpate-driver0_*.deb /packages/palpate-tools_*.deb' >/dev/null
in_root palpate --version
in_root palpate devices
in_root sh -ec '
  cd /tmp
  for letter in A E; do palpate simulate $letter -o $letter.h5; done
  palpate map A.h5 E.h5 -o maps/ --png maps.png
  palpate simulate E -o unknown.h5 --object-pose random --touches 9 --seed 2
  palpate recognize unknown.h5 --maps maps/ --json result.json
  grep -q "\"best\": *\"E\"" result.json
  test -f /usr/lib/udev/rules.d/70-palpate.rules
  test -f /usr/share/man/man1/palpate-recognize.1.gz
  test -f /usr/share/bash-completion/completions/palpate'

echo "A program of the development files:"
in_root sh -c 'apt-get install -y -qq --no-install-recommends /packages/libpalpate0_*.deb /packages/libpalpate-dev_*.deb \
    g++ cmake make pkg-config' >/dev/null
# Without the packages that only the archives need, COMPONENTS static must not be asked for.
in_root sh -ec '
  cd /consumer
  g++ -std=c++20 main.cpp -o /tmp/consumer $(pkg-config --cflags --libs palpate)
  g++ -std=c++20 board_reader.cpp -o /tmp/board_reader $(pkg-config --cflags --libs palpate-driver)
  /tmp/consumer
  /tmp/board_reader'
in_root sh -ec '
  apt-get install -y -qq --no-install-recommends libhdf5-dev libyaml-cpp-dev libfmt-dev libtbb-dev \
    libhwy-dev libusb-1.0-0-dev >/dev/null
  cmake -S /consumer -B /tmp/build -DCMAKE_BUILD_TYPE=Release >/dev/null
  cmake --build /tmp/build >/dev/null
  for program in consumer consumer_static board_reader board_reader_static; do
    /tmp/build/$program
  done'

echo "The Python module:"
in_root sh -c 'apt-get install -y -qq --no-install-recommends /packages/python3-palpate_*.deb' >/dev/null
in_root sh -ec '
  cd /usr/lib/python3/dist-packages
  test -f palpate/_palpate.pyi
  test -f palpate/__pycache__/recognition.cpython-311.pyc
  # The command is that of palpate-tools alone.
  if dpkg -L python3-palpate | grep /bin/; then exit 1; fi'
in_root /usr/bin/python3 -c '
import importlib.metadata
import palpate
assert palpate.__version__ == importlib.metadata.version("palpate") != "0"
print("palpate", palpate.__version__)
[record] = palpate.recognize("/tmp/unknown.h5", "/tmp/maps/")
print(record)
assert record.best == "E"
try:
    palpate.open_sensor("tsf85:none").start()
except palpate.Error as error:
    print(error)
    assert "not plugged in" in str(error)  # the profile of the board was found
else:
    raise SystemExit("a board that is not there was opened")'

echo "What is installed can be removed:"
in_root sh -c 'apt-get remove -y -qq libpalpate-driver0' >/dev/null
if in_root palpate --version 2>/dev/null; then
  echo "palpate runs without its library" >&2
  exit 1
fi
in_root test ! -e /usr/lib/python3/dist-packages/palpate

echo "All packages at once:"
in_root sh -c 'apt-get install -y -qq --no-install-recommends /packages/*.deb' >/dev/null
in_root sh -ec '
  palpate --version
  /tmp/consumer
  /usr/bin/python3 -c "import palpate; print(palpate.Device.open())"'
echo "passed"
