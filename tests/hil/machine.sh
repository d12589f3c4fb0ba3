#!/bin/sh
# Prepares the virtual machine of ./stage hil: machine.sh CACHE prints the directory that it is in.
# Kernel, modules and a small first root are made once per version of the kernel. Nothing of the
# kernel's source stays. When packages cannot be had it prints the reason instead and exits 77.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
cache=$1

say() { printf '%s\n' "$*" >&2; }

skip() {
	printf '%s\n' "$*"
	exit 77
}

as_root() {
	if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi
}

install_packages() {
	dpkg-checkbuilddeps "$here/debian/control" 2>/dev/null && return
	say 'Installing the packages of tests/hil/debian/control ...'
	as_root apt-get -q update >"$log" 2>&1 &&
		as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends \
			build-dep "$here" >>"$log" 2>&1 ||
		skip "no packages: $(grep -m1 -E '^(E:|sudo:)' "$log" || tail -n1 "$log")"
}

# download PACKAGE VERSION: the .deb into the work directory
download() {
	(cd "$work" && apt-get -q download "$1=$2" ||
		{ as_root apt-get -q update && apt-get -q download "$1=$2"; }) >"$log" 2>&1 ||
		skip "no package $1 of version $2: $(grep -m1 '^E:' "$log" || tail -n1 "$log")"
}

unpack_image() {
	download "linux-image-$kernel" "$version"
	dpkg -x "$work"/linux-image-*.deb "$work/image"
	[ -d "$work/image/usr/lib/modules" ] && mv "$work/image/usr/lib" "$work/image/lib"
	mkdir -p "$work/machine/lib"
	mv "$work/image/lib/modules" "$work/machine/lib/modules"
	/usr/bin/python3 "$here/vmlinux.py" "$work/image/boot/vmlinuz-$kernel" "$work/machine/vmlinux"
}

# Debian leaves these modules out of its kernels; what a later one has of them is not built.
build_modules() {
	download "linux-source-$series" "$version"
	dpkg --fsys-tarfile "$work"/linux-source-*.deb |
		tar -xO "./usr/src/linux-source-$series.tar.xz" | xz -dc -T0 |
		tar -x -C "$work" --one-top-level=source --strip-components=1 --wildcards \
			'linux-source-*/drivers/gpio/gpio-sim.c' 'linux-source-*/drivers/gpio/*.h' \
			'linux-source-*/drivers/gpio/dev-sync-probe.c' \
			'linux-source-*/drivers/usb/gadget/legacy/raw_gadget.c' \
			'linux-source-*/drivers/media/test-drivers/vimc' \
			'linux-source-*/kernel/irq/irq_sim.c' 2>"$log" || true
	mkdir "$work/build"
	find "$work/source" -name '*.[ch]' -exec cp -t "$work/build" {} +
	# The simulated interrupts are a part of the kernel that can be a module with two changes.
	sed -i -e 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' \
		-e '$a #include <linux/module.h>\nMODULE_LICENSE("GPL");' "$work/build/irq_sim.c"
	cp "$here/modules.kbuild" "$work/build/Kbuild"
	make -j"$(nproc)" -C "/lib/modules/$kernel/build" M="$work/build" modules >"$log" 2>&1 || {
		cat "$log" >&2
		say 'hil: the modules of the kernel cannot be built'
		exit 1
	}
	mkdir "$work/machine/lib/modules/$kernel/hil"
	cp "$work"/build/*.ko "$work/machine/lib/modules/$kernel/hil"
	depmod -b "$work/machine" "$kernel"
}

# A first root that unpacks the real one.
make_initramfs() {
	root=$work/initramfs
	machine=$cache/$kernel
	mkdir -p "$root/bin" "$root/modules"
	cp /bin/busybox "$root/bin/busybox"
	cp "$here/initramfs_init" "$root/init"
	modprobe -d "$machine" -S "$kernel" --show-depends --all virtio_pci 9p 9pnet_virtio |
		sed -n 's/^insmod //p' | awk '!seen[$1]++ { print $1 }' >"$work/order"
	count=100
	while read -r module; do
		count=$((count + 1))
		case $module in
		*.xz) xz -dc "$module" >"$root/modules/$count.ko" ;;
		*.zst) zstd -qdc "$module" >"$root/modules/$count.ko" ;;
		*) cp "$module" "$root/modules/$count.ko" ;;
		esac
	done <"$work/order"
	(cd "$root" && find . | cpio -o -H newc --quiet) | gzip -1 >"$work/initramfs.gz"
	mv "$work/initramfs.gz" "$machine/initramfs"
}

[ "$(dpkg --print-architecture)" = amd64 ] ||
	skip "the virtual machine is made for amd64 only, this is $(dpkg --print-architecture)"
mkdir -p "$cache"
work=$(mktemp -d "$cache/work.XXXXXX")
log=$work/log
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM

install_packages
headers=$(dpkg-query -W -f '${Depends}' linux-headers-amd64) # linux-headers-6.1.0-56-amd64 (= 6.1.192-2)
kernel=$(expr "$headers" : 'linux-headers-\([^ ]*\)')
version=$(expr "$headers" : '.*(= \(.*\))')
series=$(expr "$kernel" : '\([0-9]*\.[0-9]*\)')
if [ ! -f "$cache/$kernel/vmlinux" ]; then
	say "Preparing the virtual machine: Linux $kernel ..."
	unpack_image
	build_modules
	rm -rf "${cache:?}/$kernel"
	mv "$work/machine" "$cache/$kernel"
fi
[ "$cache/$kernel/initramfs" -nt "$here/initramfs_init" ] || make_initramfs
printf '%s\n' "$cache/$kernel"
