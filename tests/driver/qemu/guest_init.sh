#!/bin/sh
# The guest's first process: tests the driver with a real kernel, a USB gadget, udev with the shipped
# rule, and an ordinary user. Prints "ok NAME" or "not ok NAME" lines, then turns the machine off.
export PATH=/bin:/sbin LD_LIBRARY_PATH=/lib
mount -t proc none /proc
mount -t sysfs none /sys
mount -t devtmpfs none /dev
mkdir -p /run /tmp /dev/ffs
while read -r module options; do # the boards are full-speed devices
  # shellcheck disable=SC2086  # options are words
  insmod "/modules/$module.ko" $options || echo "not ok module $module"
done < /modules.list
mount -t configfs none /sys/kernel/config
systemd-udevd --daemon --resolve-names=early
gadgets=/sys/kernel/config/usb_gadget

check() { # NAME COMMAND...
  name=$1
  shift
  if "$@"; then echo "ok $name"; else echo "not ok $name"; fi
}

gadget() { # NAME VENDOR PRODUCT SERIAL CLASS FUNCTION
  mkdir "$gadgets/$1"
  cd "$gadgets/$1" || exit 1
  echo "$2" > idVendor
  echo "$3" > idProduct
  echo "$5" > bDeviceClass
  mkdir -p strings/0x409 configs/c.1 "functions/$6"
  echo "$4" > strings/0x409/serialnumber
  echo Palpate > strings/0x409/manufacturer
  echo "$1" > strings/0x409/product
  ln -s "functions/$6" configs/c.1/
  cd /
}
plug() { echo dummy_udc.0 > "$gadgets/$1/UDC"; }
unplug() { echo '' > "$gadgets/$1/UDC"; }
as_user() { # GROUPS COMMAND... (with its path: the shell would take busybox's own setpriv)
  groups=$1
  shift
  /bin/setpriv --reuid 1000 --regid 1000 --groups "$groups" "$@"
}
wait_for() { # FILE TEXT
  tries=0
  until grep -q "$2" "$1" 2>/dev/null; do
    tries=$((tries + 1))
    [ $tries -lt 200 ] || return 1
    usleep 100000
  done
}
node_of() { # VENDOR: the device node of the one board with this id
  for device in /sys/bus/usb/devices/*; do
    [ "$(cat "$device/idVendor" 2>/dev/null)" = "$1" ] &&
      printf '/dev/bus/usb/%03d/%03d' "$(cat "$device/busnum")" "$(cat "$device/devnum")"
  done
}

# A TakkTile: vendor class, no kernel driver.
gadget TakkTile 0x59e3 0x74c7 QEMU-1 0xff ffs.takktile
mount -t functionfs takktile /dev/ffs
functionfs_takktile /dev/ffs 200 > /tmp/board.txt &
wait_for /tmp/board.txt ready
plug TakkTile
usleep 500000
udevadm settle
node=$(node_of 59e3)
ls -l "$node"
check "udev rule gives the node to plugdev" \
  sh -c "ls -l $node | grep -q '^crw-rw---- .* root *plugdev'"

as_user 1000 palpate sensors > /tmp/denied.txt 2>&1
cat /tmp/denied.txt
check "sensors names the udev rule where permission is denied" \
  grep -q 70-palpate.rules /tmp/denied.txt
as_user 1000 stream_frames takktile 1 > /tmp/denied.txt 2>&1
status=$?
cat /tmp/denied.txt
check "opening without permission names the udev rule" \
  sh -c "[ $status -ne 0 ] && grep -q 70-palpate.rules /tmp/denied.txt"

as_user 1000,46 palpate sensors
as_user 1000,46 stream_frames takktile:QEMU-1 10 > /tmp/frames.txt 2>&1
check "a member of plugdev streams" [ $? -eq 0 ]
cat /tmp/frames.txt
check "10 s at 200 frames/s without loss" stream_frames --check /tmp/frames.txt 1900 0

# The board is unplugged while it streams, and plugged in again.
as_user 1000,46 stream_frames takktile:QEMU-1 15 > /tmp/frames.txt 2>&1 &
streaming=$!
sleep 2
unplug TakkTile
sleep 1
plug TakkTile
wait $streaming
cat /tmp/frames.txt
check "frames go on after a reconnection" stream_frames --check /tmp/frames.txt 400 1
unplug TakkTile

# A serial board: the kernel's own driver takes it first.
gadget TSF-85 0x16d0 0x14cc QEMU-2 0x02 acm.0
plug TSF-85
usleep 500000
udevadm settle
check "the kernel's driver has the serial board" [ -e /dev/ttyACM0 ]
acm_tsf85 /dev/ttyGS0 > /tmp/board.txt &
as_user 1000,46 stream_frames tsf85:QEMU-2 10 > /tmp/frames.txt 2>&1
check "the driver takes it from the kernel's" [ $? -eq 0 ]
cat /tmp/frames.txt
check "10 s of a serial board without loss" stream_frames --check /tmp/frames.txt 900 0
usleep 500000
check "and gives it back" [ -e /dev/ttyACM0 ]
unplug TSF-85

echo "done"
poweroff -f
