# Cases of a test in shell: check NAME COMMAND..., at last tell.
cases=0 broken=0

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
	echo "1..$cases"
	exit $broken
}
