# For a test in shell: run PROGRAM... for programs that tell their own cases, check NAME COMMAND...
# for a case of the script, await what takes time, and at last tell.
cases=0 broken=0

run() {
	echo "# $*"
	"$@" || broken=1
}

check() {
	name=$1
	shift
	cases=$((cases + 1))
	if "$@"; then
		echo "ok $cases - $name"
	else
		broken=1
		echo "not ok $cases - $name"
	fi
}

# await COMMAND...: until it succeeds, 20 s at most
await() {
	for _ in $(seq 100); do
		"$@" && return
		sleep 0.2
	done
	false
}

tell() {
	exit $broken
}
