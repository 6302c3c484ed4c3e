# shellcheck shell=bash
# For the scripts of this folder, which source it: a fresh Debian 12 in the folder $root, made by
# make_root and removed at the end.

mirror=${MIRROR:-http://deb.debian.org/debian}

skip() {
  echo "skipped: $*" >&2
  exit 77
}

require_debootstrap() {
  [ "$(id -u)" -eq 0 ] || skip "debootstrap needs root"
  command -v debootstrap >/dev/null || skip "debootstrap is missing: apt-get install debootstrap"
}

finish() {
  umount "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}

# make_root FLAG OF debootstrap...
make_root() {
  local file
  root=$(mktemp -d)
  chmod 755 "$root"  # apt downloads as a user of its own
  trap finish EXIT
  debootstrap "$@" bookworm "$root" "$mirror" >"$root.log" 2>&1 || {
    tail -n 5 "$root.log" >&2
    rm "$root.log"
    skip "debootstrap cannot make a root of Debian 12 here"
  }
  rm "$root.log"
  mount -t proc proc "$root/proc" || skip "cannot mount /proc in the new root"
  # The machine's own way to the mirror: name servers, proxy.
  for file in /etc/resolv.conf /etc/hosts; do
    cp -L "$file" "$root$file"
  done
  cp /etc/apt/apt.conf.d/*proxy* "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
}

# in_root COMMAND...: runs it in the root, with root_environment, variables as NAME=VALUE.
root_environment=()
in_root() {
  chroot "$root" env -i PATH=/environment/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
    DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "${root_environment[@]}" "$@"
}
