/*
 * What the aravis driver says when there is no way to a camera: in networks that the test makes,
 * each in a process of its own.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/aravis/aravis.h"
#include "tests/tap_case.h"

#define GVCP_PORT 3956
#define CANNOT 99 /* exit code: no network of one's own */

static const struct camera_driver *const driver = &aravis_camera_driver;

static void raise_loopback(int fd)
{
	struct ifreq request = {.ifr_name = "lo", .ifr_flags = IFF_UP | IFF_RUNNING};

	if (ioctl(fd, SIOCSIFFLAGS, &request))
		_exit(CANNOT);
}

static void no_network(int fd)
{
	(void)fd;
}

/* Everything goes to lo, and what is not for this machine is dropped there. */
static void way_out_that_leads_nowhere(int fd)
{
	struct rtentry route = {.rt_flags = RTF_UP, .rt_dev = (char *)"lo"};

	raise_loopback(fd);
	route.rt_dst.sa_family = route.rt_genmask.sa_family = AF_INET;
	if (ioctl(fd, SIOCADDRT, &route))
		_exit(CANNOT);
}

static int udp_socket(void)
{
	return socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

/* The machine is there, and what answers at the port is no camera. */
static void stranger(int fd)
{
	struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(GVCP_PORT)};
	char packet[600];

	raise_loopback(fd);
	at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
	int server = udp_socket();

	if (bind(server, (struct sockaddr *)&at, sizeof(at)) || fork() != 0)
		return;
	for (;;) {
		socklen_t size = sizeof(at);

		if (recvfrom(server, packet, sizeof(packet), 0, (struct sockaddr *)&at, &size) > 0)
			sendto(server, "what?", 5, 0, (struct sockaddr *)&at, size);
	}
}

static void only_loopback(int fd)
{
	raise_loopback(fd);
}

/* In a child, whose network it becomes. */
static void make_network(void (*network)(int fd))
{
	if (unshare(CLONE_NEWNET) && unshare(CLONE_NEWUSER | CLONE_NEWNET))
		_exit(CANNOT);
	network(udp_socket());
}

/* In the child: opens and tells. */
static void try_open(void (*network)(int fd), const char *rest, int out_fd)
{
	struct camera *camera = NULL;
	struct diag diag = {0};

	setpgid(0, 0);
	make_network(network);
	int error = driver->open(&camera, rest, NULL, &diag);
	char count[16];

	snprintf(count, sizeof(count), "%u:", (unsigned)diag.count);
	if (write(out_fd, count, strlen(count)) < 0 ||
	    (diag.text && write(out_fd, diag.text, strlen(diag.text)) < 0))
		_exit(1);
	_exit(-error);
}

/* One message, with each of the words, which end with NULL. */
static void refused(void (*network)(int fd), const char *rest, int error, ...)
{
	char said[2000] = "";
	size_t length = 0;
	int fds[2], status = 0;
	va_list words;

	assert_int_equal(pipe(fds), 0);
	pid_t child = fork();

	if (child == 0)
		try_open(network, rest, fds[1]);
	close(fds[1]);
	waitpid(child, &status, 0);
	kill(-child, SIGKILL); /* its stranger */
	for (ssize_t n; (n = read(fds[0], said + length, sizeof(said) - 1 - length)) > 0;)
		length += (size_t)n;
	close(fds[0]);
	assert_true(WIFEXITED(status));
	assert_int_equal(WEXITSTATUS(status), -error);
	assert_memory_equal(said, "1:", 2);
	assert_non_null(strstr(said, rest));
	va_start(words, error);
	for (const char *word; (word = va_arg(words, const char *));)
		if (!strstr(said, word))
			fail_msg("'%s' is not in: %s", word, said);
	va_end(words);
}

static void a_machine_without_a_network_is_told_so(void **state)
{
	(void)state;
	refused(no_network, "192.168.77.20", -EHOSTUNREACH, "unreachable: Network is unreachable",
		"networks are none", "give the network port of the cameras an address", NULL);
}

static void an_address_of_another_network_is_told_with_the_machines_own(void **state)
{
	(void)state;
	refused(way_out_that_leads_nowhere, "10.9.9.9", -EHOSTUNREACH,
		"no answer, and another network", "networks are lo 127.0.0.1/8",
		"or the camera one in the port's", NULL);
}

static void a_broadcast_address_is_not_permitted(void **state)
{
	(void)state;
	refused(only_loopback, "127.255.255.255", -EACCES, "permission denied",
		"a broadcast address, or a firewall", "address one camera", NULL);
}

static void a_machine_that_is_no_camera_is_told(void **state)
{
	(void)state;
	refused(only_loopback, "127.0.0.9", -ENODEV, "no camera here", "does not speak GigE Vision",
		"camera list", NULL);
}

static void what_answers_and_is_no_camera_is_told(void **state)
{
	(void)state;
	refused(stranger, "127.0.0.1", -ENODEV, "answers, but cannot be used as a camera",
		"start it anew", NULL);
}

static const char *networks_lack(void)
{
	int status = 0;
	pid_t child = fork();

	if (child == 0) {
		make_network(way_out_that_leads_nowhere);
		_exit(EXIT_SUCCESS);
	}
	waitpid(child, &status, 0);
	return status == 0 ? NULL : "a network of one's own is not permitted";
}

int main(void)
{
	const char *lack = networks_lack();
	const struct CMUnitTest tests[] = {
		unit_test_unless(lack, a_machine_without_a_network_is_told_so),
		unit_test_unless(lack, an_address_of_another_network_is_told_with_the_machines_own),
		unit_test_unless(lack, a_broadcast_address_is_not_permitted),
		unit_test_unless(lack, a_machine_that_is_no_camera_is_told),
		unit_test_unless(lack, what_answers_and_is_no_camera_is_told),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
