# For a test in shell: run PROGRAM... for programs that tell their own cases, check NAME COMMAND...
# for a case of the script, and at last tell.
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

tell() {
	exit $broken
}
