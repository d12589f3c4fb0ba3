# gpio_sim NAME LINE...: a chip of the kernel's gpio-sim with these lines. Sets `config`, the
# directory that takes it away, and `device`, the one where its wires are.
gpio_sim() {
	config=/sys/kernel/config/gpio-sim/$1
	mkdir "$config" "$config/bank"
	echo "$1" >"$config/bank/label"
	shift
	echo $# >"$config/bank/num_lines"
	for offset in $(seq 0 $(($# - 1))); do
		mkdir "$config/bank/line$offset"
		echo "$1" >"$config/bank/line$offset/name"
		shift
	done
	echo 1 >"$config/live"
	device=/sys/devices/platform/$(cat "$config/dev_name")
}
