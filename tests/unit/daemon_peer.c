/*
 * Who may do what over the control socket.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <errno.h>
#include <grp.h>
#include <stdbool.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/control/peer.h"
#include "tests/tap_case.h"

static const struct peer_rules rules = {.masters = {0, 990}, .look = 500, .command = 501};

static enum permission permission(uid_t uid, gid_t first, gid_t second)
{
	gid_t groups[] = {first, second};

	return peer_permission(&rules, uid, groups, 2);
}

static void root_and_the_own_user_may_command(void **state)
{
	(void)state;
	assert_int_equal(permission(0, 7, 8), PERMISSION_COMMAND);
	assert_int_equal(permission(990, 7, 8), PERMISSION_COMMAND);
}

static void each_group_gives_its_right_and_no_other(void **state)
{
	(void)state;
	assert_int_equal(permission(1000, 500, 8), PERMISSION_LOOK);
	assert_int_equal(permission(1000, 7, 500), PERMISSION_LOOK);
	assert_int_equal(permission(1000, 7, 501), PERMISSION_COMMAND);
	assert_int_equal(permission(1000, 500, 501), PERMISSION_COMMAND);
	assert_int_equal(permission(1000, 7, 8), PERMISSION_NONE);
	assert_int_equal(peer_permission(&rules, 1000, NULL, 0), PERMISSION_NONE);
}

static void groups_that_the_machine_lacks_are_nobodys(void **state)
{
	struct peer_rules none = {.masters = {0, 990}, .look = GID_NONE, .command = GID_NONE};
	gid_t groups[] = {GID_NONE, 1000};

	(void)state;
	assert_int_equal(peer_permission(&none, 1000, groups, 2), PERMISSION_NONE);
}

/* What the other end of a socket may do, when our own group is the one that may look. */
static void the_kernel_tells_who_connected(void **state)
{
	struct peer_rules own = {.masters = {4242, 4243}, .look = getegid(), .command = GID_NONE};
	int fds[2];

	(void)state;
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
	assert_int_equal(peer_permission_of_socket(&own, fds[0]), PERMISSION_LOOK);
	own.look = GID_NONE;
	assert_int_equal(peer_permission_of_socket(&own, fds[0]), PERMISSION_NONE);
	own.masters[1] = geteuid();
	assert_int_equal(peer_permission_of_socket(&own, fds[0]), PERMISSION_COMMAND);
	close(fds[0]);
	close(fds[1]);
}

/* In a child with other groups: 0 when it has that permission. */
static int child_has(enum permission wanted)
{
	gid_t groups[] = {600, 501, 602};
	int fds[2];

	if (setgroups(3, groups) < 0 || setresgid(610, 610, 610) < 0 ||
	    setresuid(611, 611, 611) < 0 || socketpair(AF_UNIX, SOCK_STREAM, 0, fds) < 0)
		return 1;
	return peer_permission_of_socket(&rules, fds[0]) == wanted ? 0 : 2;
}

/* QEMU, where it emulates one process, takes every option for one number. */
static bool kernel_tells_groups(void)
{
	int fds[2];
	socklen_t bytes = 0;

	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
	bool tells =
		getsockopt(fds[0], SOL_SOCKET, SO_PEERGROUPS, NULL, &bytes) == 0 || errno == ERANGE;
	close(fds[0]);
	close(fds[1]);
	return tells;
}

static void supplementary_groups_count_where_the_kernel_tells_them(void **state)
{
	int status;

	(void)state;
	enum permission wanted = kernel_tells_groups() ? PERMISSION_COMMAND : PERMISSION_NONE;
	pid_t child = fork();

	if (child == 0)
		_exit(child_has(wanted));
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_int_equal(status, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(root_and_the_own_user_may_command),
		cmocka_unit_test(each_group_gives_its_right_and_no_other),
		cmocka_unit_test(groups_that_the_machine_lacks_are_nobodys),
		cmocka_unit_test(the_kernel_tells_who_connected),
		unit_test_unless(geteuid() == 0 ? NULL : "only root may change groups",
				 supplementary_groups_count_where_the_kernel_tells_them),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
