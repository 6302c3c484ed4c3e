#!/usr/bin/env bash
# Installs the wheel in a fresh Debian 12 that has Python and none of the libraries that Palpate
# stands on, no font and no Vulkan; then installs Vulkan and recognises a letter there, with the
# command and in Python. Run by hand, as root, after `./dev wheel`:
#   tests/packages/wheel.sh [WHEEL OF CPYTHON 3.11 [FOLDER FOR PICTURES]]
# Needs debootstrap, the network, about 2 GB in $TMPDIR, and some minutes. Exits with 77 where the
# test cannot run. The pictures are for the eye; that their text is DejaVu Sans is tested, too.
# Commands of the new root stand in single quotes, so that this shell expands nothing in them.
# shellcheck disable=SC2016
set -euo pipefail

source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

# shellcheck source=tests/packages/root.sh
. "$source/tests/packages/root.sh"
require_debootstrap
wheel=${1:-$(compgen -G "$source/build-wheel/palpate-*-cp311-*manylinux*.whl" || true)}
[ -f "$wheel" ] || {
  echo "no wheel of CPython 3.11, which Debian 12 has: run ./dev wheel" >&2
  exit 2
}

make_root --variant=minbase --include=python3,python3-venv
echo 'Dpkg::Use-Pty "0";' >"$root/etc/apt/apt.conf.d/99no-terminal"

# NumPy comes from this machine's index: the root needs no certificates.
python3 -m venv "$root/download"
"$root/download/bin/python" -m pip download --quiet --disable-pip-version-check --only-binary :all: \
  --python-version 3.11 --dest "$root/wheels" numpy || skip "cannot download NumPy"
cp "$wheel" "$root/wheels"
in_root sh -ec '
  rm -r /download
  python3 -m venv /environment
  pip install --quiet --no-index --find-links /wheels palpate'

echo "Nothing that Palpate stands on is there:"
in_root sh -ec '
  for library in vulkan hdf5 fmt yaml-cpp cairo X11 xcb fontconfig freetype png usb tbb; do
    if ls /usr/lib/x86_64-linux-gnu/lib$library[-_.0-9]* 2>/dev/null; then exit 1; fi
  done
  if find / -xdev \( -path /environment -o -path /proc \) -prune -o -name "*.ttf" -print | grep .
  then exit 1; fi
  test ! -e /etc/fonts'
echo "yes"

echo "What needs no device:"
in_root python -c '
import palpate
print("palpate", palpate.__version__)
touches = palpate.simulate("A", seed=1)
touches.save("/tmp/python.h5")
assert len(palpate.read_recording("/tmp/python.h5")) == len(touches)
for use, says in [
    (palpate.Device.open, "install libvulkan1 and mesa-vulkan-drivers"),
    (lambda: palpate.open_sensor("tsf85:none").start(), "not plugged in"),
]:
    try:
        use()
    except palpate.Error as error:
        print(error)
        assert says in str(error), says
    else:
        raise SystemExit("no error that says " + says)'
in_root sh -ec '
  palpate --version
  cd /tmp
  for letter in A E; do palpate simulate $letter -o $letter.h5; done
  palpate simulate E -o unknown.h5 --object-pose random --touches 9 --seed 2
  palpate info unknown.h5
  palpate sensors
  if palpate map A.h5 E.h5 -o maps/ 2>complaint; then exit 1; fi
  grep "install libvulkan1 and mesa-vulkan-drivers" complaint'

echo "With Vulkan:"
in_root apt-get update -qq
in_root apt-get install -y -qq --no-install-recommends libvulkan1 mesa-vulkan-drivers >/dev/null
in_root sh -ec '
  test ! -e /usr/share/fonts
  cd /tmp
  palpate devices
  palpate map A.h5 E.h5 -o maps/ --png maps.png 2>complaint
  palpate recognize unknown.h5 --maps maps/ --json result.json --png sheets 2>>complaint
  cat complaint
  test ! -s complaint
  # A user who may write nothing, and has no home.
  chmod a+rx . maps
  mkdir -m 777 open
  cd open
  HOME=/nonexistent setpriv --reuid=65534 --regid=65534 --clear-groups \
    palpate map ../A.h5 ../E.h5 -o maps/ --png maps.png 2>complaint
  cat complaint
  test ! -s complaint
  cmp maps.png ../maps.png
  cd ..
  grep -q "\"best\": *\"E\"" result.json'
in_root python -c '
import palpate
[record] = palpate.recognize("/tmp/unknown.h5", "/tmp/maps/")
print(record)
assert record.best == "E"'

echo "The pictures are those of a machine with the font:"
in_root apt-get install -y -qq --no-install-recommends fontconfig-config fonts-dejavu-core >/dev/null
in_root sh -ec '
  cd /tmp
  FONTCONFIG_FILE=/etc/fonts/fonts.conf palpate map A.h5 E.h5 -o again/ --png again.png
  cmp again.png maps.png
  mkdir empty
  echo "<fontconfig><dir>/tmp/empty</dir></fontconfig>" >empty/fonts.conf
  FONTCONFIG_FILE=/tmp/empty/fonts.conf palpate map A.h5 E.h5 -o again2/ --png without.png
  if cmp -s without.png maps.png; then
    echo "no text shows a difference" >&2
    exit 1
  fi'
if [ $# -ge 2 ]; then
  cp -r "$root/tmp/maps.png" "$root/tmp/sheets" "$2"
fi
echo "passed"
