#!/usr/bin/env bash
# Compiles Palpate for 64-bit ARM (aarch64) in a fresh Debian 12 and runs its tests there under
# qemu-user: model, files, bounds (with NEON), streaming, the driver's parsing, and the golden values on
# lavapipe. qemu limits no process's memory, and umockdev's boards are not seen under it: some tests of
# files skip, and those of the driver are left out.
# Run by hand, as root:
#   tests/packages/arm64.sh [PROGRAM OF TESTS...]
# Needs debootstrap, the network, about 3 GB in $TMPDIR, and an hour of two cores. Exits with 77 where
# the test cannot run.
set -euo pipefail

source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
programs=("$@")
[ $# -gt 0 ] || programs=(model_test io_test estimation_bounded_test
  streaming_test parsing_test golden_test)

# shellcheck source=tests/packages/root.sh
. "$source/tests/packages/root.sh"
require_debootstrap

make_root --variant=minbase
root_environment=(PKG_CONFIG_LIBDIR=/usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig)

echo "Installing compilers of this machine's, and libraries of ARM's"
tools=(g++-aarch64-linux-gnu cmake ninja-build pkg-config glslang-tools spirv-tools qemu-user-static
  python3 fonts-dejavu-core libglm-dev libcli11-dev nlohmann-json3-dev libvulkan-volk-dev)
libraries=(libvulkan-dev libvulkan1 mesa-vulkan-drivers vulkan-validationlayers libhdf5-dev libhwy-dev
  libtbb-dev libcpp-httplib-dev libfmt-dev libyaml-cpp-dev libcairo2-dev libfontconfig-dev
  libusb-1.0-0-dev libgtest-dev libgmock-dev libumockdev-dev)
{
  in_root dpkg --add-architecture arm64
  in_root apt-get update -qq
  in_root apt-get install -y -qq --no-install-recommends "${tools[@]}"
  # What a package would run of its own after it is unpacked is ARM's, and not needed here.
  in_root apt-get install -y -qq --no-install-recommends "${libraries[@]/%/:arm64}"
} >"$root/apt.log" 2>&1 || {
  tail -n 5 "$root/apt.log" >&2
  skip "packages cannot be installed"
}

mkdir "$root/source"
git -C "$source" archive HEAD | tar -x -C "$root/source"
in_root cmake -S /source -B /build -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON \
  -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 \
  -DCMAKE_C_COMPILER=aarch64-linux-gnu-gcc -DCMAKE_CXX_COMPILER=aarch64-linux-gnu-g++ \
  -DCMAKE_LIBRARY_ARCHITECTURE=aarch64-linux-gnu \
  -DCMAKE_CROSSCOMPILING_EMULATOR=/usr/bin/qemu-aarch64-static \
  -DPALPATE_BENCH=OFF -DPALPATE_WERROR=ON -DPALPATE_TESTS=ON --log-level=WARNING
in_root cmake --build /build --target "${programs[@]}"
in_root env GTEST_BRIEF=1 \
  ctest --test-dir /build --output-on-failure -j "$(nproc)" -R "^($(IFS='|' && echo "${programs[*]}"))"
