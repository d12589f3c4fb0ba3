#!/bin/sh
# One part of ./stage release: part.sh SOURCE ROOT DEBIAN ARCHITECTURE SUITES DISK_MB
# Makes a Debian in the directory ROOT, builds the project in it and runs its tests. release.py starts
# it as root, as the first process of namespaces of its own: what it mounts and starts is gone with it,
# however it ends, and it ends when its standard input does. Exits 77 when it cannot run here.
set -eu
source=$1 root=$2 debian=$3 architecture=$4 suites=$5 disk_mb=$6
name=${root##*/} log=$root.log

say() { printf '%s: %s\n' "$name" "$*" >&2; }

skip() {
	printf '%s\n' "$*"
	exit 77
}

# quietly COMMAND: its words go to the log, and are shown when it fails
quietly() {
	"$@" >"$log" 2>&1 || {
		cat "$log" >&2
		skip "${1##*/} failed: $(grep -m1 '^E:' "$log" || tail -n1 "$log")"
	}
}

# The machine's own package source for Debian proper; nothing else is asked.
find_mirror() {
	for try in first again; do
		mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' \
			'Label: Debian' 'Component: main' | head -n1)
		[ -z "$mirror" ] || return 0
		[ "$try" = again ] || quietly apt-get -q update
	done
	skip 'no package source of Debian among those of apt (/etc/apt/sources.list*)'
}

check_disk() {
	free_mb=$(df --output=avail -BM "${root%/*}" | tail -n1 | tr -cd 0-9)
	[ "$free_mb" -ge "$disk_mb" ] ||
		skip "${root%/*} has $free_mb MB free, $disk_mb MB are needed"
}

make_root() {
	[ ! -d "$root" ] || return 0
	check_disk
	find_mirror
	[ -x /usr/sbin/debootstrap ] || {
		say 'installing debootstrap ...'
		quietly apt-get -q update
		quietly apt-get -q -y --no-install-recommends install debootstrap
	}
	say "making a root of Debian $debian, $disk_mb MB with all that follows ..."
	rm -rf "$root.new"
	quietly /usr/sbin/debootstrap --variant=minbase --include=ca-certificates "$debian" "$root.new" "$mirror"
	mkdir -p "$root.new/stage/source" "$root.new/stage/debian"
	apt-config dump | grep -E '^Acquire::https?::' >"$root.new/etc/apt/apt.conf.d/90machine" || true
	mv "$root.new" "$root"
}

mount_all() {
	mount -t proc proc "$root/proc"
	mount -t tmpfs tmpfs "$root/tmp"
	mount -t tmpfs tmpfs "$root/dev/shm"
	mount --bind "$source" "$root/stage/source"
	mount -o remount,bind,ro "$root/stage/source"
	cp -L /etc/resolv.conf "$root/etc/resolv.conf"
}

inside() {
	chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 \
		DEBIAN_FRONTEND=noninteractive "$@"
}

# debian/control, with the libraries of the other architecture. SIMDe is headers for any.
write_control() {
	if [ "$architecture" = native ]; then
		cat "$source/debian/control"
	else
		sed -E -e "s/^ (lib[a-z0-9.+-]*-dev)\b/ \1:$architecture/" -e 's/(libsimde-dev):[a-z0-9]*/\1/' \
			-e "s/^Build-Depends:/&\n crossbuild-essential-$architecture,\n qemu-user-static,/" \
			"$source/debian/control"
	fi
}

install_packages() {
	write_control >"$root/stage/control"
	! cmp -s "$root/stage/control" "$root/stage/debian/control" || return 0
	say 'installing packages ...'
	check_disk
	[ "$architecture" = native ] || quietly inside dpkg --add-architecture "$architecture"
	quietly inside apt-get -q update
	mkdir -p "$root/stage/wanted/debian"
	cp "$root/stage/control" "$root/stage/wanted/debian/control"
	quietly inside apt-get -q -y --no-install-recommends build-dep /stage/wanted
	quietly inside apt-get clean
	cp "$root/stage/control" "$root/stage/debian/control"
}

build() {
	say 'building ...'
	[ -f "$root/stage/build/build.ninja" ] || {
		cross=
		[ "$architecture" = native ] || cross="--cross-file /stage/source/tests/release/$architecture.ini"
		inside meson setup $cross /stage/build /stage/source >&2
	}
	inside ninja -k 0 -C /stage/build >&2
}

run_tests() {
	say 'testing ...'
	rm -f "$root"/stage/build/meson-logs/testlog.*
	patience=60 # an emulated processor is that much slower, on a busy machine
	[ "$architecture" != native ] || patience=4
	inside meson test -C /stage/build --no-rebuild --print-errorlogs --timeout-multiplier "$patience" \
		$(printf '%s' "$suites" | sed 's/^\|,/ --suite /g') >&2
}

run() {
	make_root
	mount_all
	install_packages
	build
	run_tests
}

exec 3<&0
{ cat >/dev/null; kill -TERM $$; } <&3 &
trap 'exit 1' HUP INT TERM
run &
wait $!
