#!/usr/bin/env bash
# Builds Palpate on a machine with a GPU, measures the kernels and the bounds beside the dense engine,
# and runs the tests on the device. Writes logs and JSON to FOLDER. Needs the packages that dev lists.
# With --built it takes build/ as it was copied from another machine, to the same path; it then needs
# the libraries of the programs, and CTest, and runs the programs of tests that open a device. Exits with
# 1 if a step failed; without a build or a device it stops, and after any other failure it runs the
# remaining steps.
set -euo pipefail

usage() {
  echo "usage: bench/measure_gpu.sh FOLDER [--device NAME|INDEX] [--quick] [--built]" >&2
  exit 2
}

folder='' device='' quick=0 built=0
while [ $# -gt 0 ]; do
  case $1 in
    --device)
      [ $# -ge 2 ] || usage
      device=$2
      shift
      ;;
    --quick) quick=1 ;;
    --built) built=1 ;;
    -*) usage ;;
    *)
      [ -z "$folder" ] || usage
      folder=$1
      ;;
  esac
  shift
done
[ -n "$folder" ] || usage
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
cd "$(dirname "${BASH_SOURCE[0]}")/.."

status=0
# step NAME COMMAND...: runs the command with its output in FOLDER/NAME.log.
step() {
  local name=$1 start=$SECONDS
  shift
  if "$@" >"$folder/$name.log" 2>&1; then
    echo "$name: done in $((SECONDS - start)) s"
  else
    echo "$name: failed, see $folder/$name.log" >&2
    status=1
    return 1
  fi
}

# The benchmark's test would run the benchmark again.
choice=(-E '^bench.test_command') bench_options=()
# Programs without the option --device, such as the tests, read PALPATE_DEVICE.
if [ -n "$device" ]; then
  export PALPATE_DEVICE=$device
  bench_options+=(--device "$device")
fi
if [ $quick -eq 1 ]; then
  choice+=(-LE slow)
  bench_options+=(--quick)
fi

if [ $built -eq 1 ]; then
  choice+=(-R '^(gpu|estimation|golden|hard_cases|recognition|learning|streaming|embedding|cli)_')
else
  step configure cmake --preset release -DPALPATE_TESTS=ON || exit 1
  step build cmake --build --preset release || exit 1
fi
step devices build/palpate devices || exit 1
step kernels build/palpate-bench kernels "${bench_options[@]}" --json "$folder/kernels.json" || true
step bounded build/palpate-bench bounded --part speed "${bench_options[@]}" \
  --json "$folder/bounded.json" || true
step tests ctest --test-dir build --output-on-failure -j "$(nproc)" "${choice[@]}" \
  --output-junit "$folder/tests.xml" || true
exit $status
