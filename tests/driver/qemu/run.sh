#!/usr/bin/env bash
# Tests the driver on Debian's kernel, booted under QEMU with a USB gadget (see guest_init.sh).
#
#   run.sh SCRATCH DRIVER PROGRAM...
#
# DRIVER is the folder with the udev rule and the boards' profiles.
#
# Exits with 77 (skipped) and the reason if QEMU, busybox, udev or a kernel with its modules is
# missing. PALPATE_TEST_KERNEL names the folder of a kernel package unpacked with dpkg -x; by
# default, the script looks for the machine's own kernels.
set -euo pipefail

skip() {
  echo "skipped: $*"
  exit 77
}

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
scratch=$1
driver=$2
shift 2

for tool in qemu-system-x86_64 busybox cpio udevadm setpriv modinfo; do
  command -v "$tool" >/dev/null || skip "$tool is not installed"
done
[ "$(uname -m)" = x86_64 ] || skip "the guest is an x86-64 kernel"
root=${PALPATE_TEST_KERNEL:-}
release=
for folder in "$root"/lib/modules/*; do
  if [ -e "$folder/kernel/drivers/usb/gadget/udc/dummy_hcd.ko" ] &&
    [ -r "$root/boot/vmlinuz-${folder##*/}" ]; then
    release=${folder##*/}
  fi
done
[ -n "$release" ] ||
  skip "no kernel with the module dummy_hcd in '$root/boot' and '$root/lib/modules'; unpack" \
    "Debian's linux-image package and name the folder in PALPATE_TEST_KERNEL"

rm -rf "$scratch"
guest=$scratch/guest
mkdir -p "$guest"/{bin,sbin,lib,lib64,modules,etc,proc,sys,dev,run,tmp} \
  "$guest"/lib/udev/rules.d

# Modules in the order of their dependencies.
order=(usb-common usbcore udc-core dummy_hcd configfs libcomposite usb_f_fs u_serial usb_f_acm
  cdc-acm)
for module in "${order[@]}"; do
  file=$(find "$root/lib/modules/$release" -name "$module.ko" | head -n 1)
  if [ -n "$file" ]; then # else it is built into the kernel
    cp "$file" "$guest/modules/$module.ko"
    [ "$module" = dummy_hcd ] && options=' is_high_speed=0' || options=
    echo "$module$options" >> "$guest/modules.list"
  fi
done

# Copies the programs and the libraries that they load.
busybox=$(command -v busybox)
cp "$busybox" "$guest/bin/busybox"
for applet in $("$busybox" --list); do
  [ "$applet" = busybox ] || ln -sf busybox "$guest/bin/$applet"
done
rm -f "$guest"/bin/{udevadm,setpriv}
for program in "$(command -v udevadm)" "$(command -v setpriv)" "$@"; do
  cp "$program" "$guest/bin/"
  ldd "$program" | awk '$2 == "=>" {print $3} $1 ~ /^\// {print $1}' | while read -r library; do
    cp -nL "$library" "$guest/lib/"
  done
done
cp -L /lib64/ld-linux-x86-64.so.2 "$guest/lib64/"
ln -sf udevadm "$guest/bin/systemd-udevd"
cp /lib/udev/rules.d/50-udev-default.rules "$driver/70-palpate.rules" "$guest/lib/udev/rules.d/"
mkdir -p "$guest/share/palpate"
cp -r "$driver/70-palpate.rules" "$driver/profiles" "$guest/share/palpate/"
cp "$here/guest_init.sh" "$guest/init"
chmod +x "$guest/init"
printf 'root:x:0:0::/:/bin/sh\nuser:x:1000:1000::/:/bin/sh\n' > "$guest/etc/passwd"
printf 'root:x:0:\nplugdev:x:46:\nuser:x:1000:\n' > "$guest/etc/group"

(cd "$guest" && find . | cpio --quiet -o -H newc) | gzip -1 > "$scratch/initramfs.gz"
status=0
timeout 300 qemu-system-x86_64 -accel tcg,thread=multi -smp 2 -m 1024 -no-reboot -nographic \
  -kernel "$root/boot/vmlinuz-$release" -initrd "$scratch/initramfs.gz" \
  -append "console=ttyS0 quiet panic=-1" < /dev/null > "$scratch/console.txt" 2>&1 || status=$?
tr -d '\r' < "$scratch/console.txt" > "$scratch/log.txt"
cat "$scratch/log.txt"
[ $status -eq 0 ] || { echo "the guest ended with status $status"; exit 1; }
grep -q '^done$' "$scratch/log.txt" || { echo "the guest did not finish"; exit 1; }
grep -q '^ok ' "$scratch/log.txt" && ! grep -q '^not ok' "$scratch/log.txt"
