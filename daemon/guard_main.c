/*
 * stage-guard: keeps strobes from burning when the station cannot switch them off. The station
 * starts it with a copy of its lines (drivers/gpio/trigger_guard.h); it waits, and sets them dark
 * when a line is lit too long or the station is gone. It allocates nothing and heeds no signal that
 * can be ignored: only the station's end is its end.
 */
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "drivers/gpio/gpio_lines.h"
#include "drivers/gpio/trigger_guard.h"

#define PRIORITY_GUARD 70 /* above the trigger's */

static void ignore_signals(void)
{
	static const int signals[] = {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGPIPE};

	for (size_t i = 0; i < sizeof(signals) / sizeof(signals[0]); i++)
		signal(signals[i], SIG_IGN);
}

/* It holds nothing of the station's but the lines: whoever reads what the station says would wait
 * for the guard's end too. */
static void let_go(void)
{
	int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);

	for (int fd = 0; fd < GUARD_LINES && nowhere >= 0; fd++)
		dup2(nowhere, fd);
	close_range(GUARD_FD_END, ~0U, 0);
}

/* As far as it is allowed: a guard with normal scheduling is better than none. */
static void become_realtime(void)
{
	struct sched_param param = {.sched_priority = PRIORITY_GUARD};

	sched_setscheduler(0, SCHED_FIFO, &param);
	mlockall(MCL_CURRENT | MCL_FUTURE);
	prctl(PR_SET_TIMERSLACK, 1);
}

static void keep_guard(struct guard_page *page, uint32_t count, uint32_t dark_levels)
{
	struct pollfd polled[] = {{.fd = GUARD_STATION, .events = POLLIN},
				  {.fd = GUARD_TIMER, .events = POLLIN}};

	while (!polled[0].revents) {
		uint64_t times;

		if (poll(polled, 2, -1) < 0)
			polled[0].revents = polled[1].revents = 0; /* a signal */
		/* set anew since: nothing is to be read, and nothing is wrong */
		if (polled[1].revents && read(GUARD_TIMER, &times, sizeof(times)) > 0) {
			gpio_fd_set(GUARD_LINES, count, dark_levels);
			atomic_fetch_add(&page->cut_count, 1);
		}
	}
	gpio_fd_set(GUARD_LINES, count, dark_levels);
}

static int as_number(const char *text)
{
	char *end;
	long number = strtol(text, &end, 10);

	return *text && !*end && number >= 0 && number < 1 << GPIO_OUTPUT_MAX ? (int)number : -1;
}

int main(int argc, char **argv)
{
	int count = argc == 3 ? as_number(argv[1]) : -1,
	    levels = argc == 3 ? as_number(argv[2]) : -1;
	struct guard_page *page;

	ignore_signals();
	page = mmap(NULL, sizeof(*page), PROT_READ | PROT_WRITE, MAP_SHARED, GUARD_PAGE, 0);
	if (count < 1 || count > GPIO_OUTPUT_MAX || levels < 0 || page == MAP_FAILED) {
		fputs("stage-guard: the station starts it, nobody else\n", stderr);
		return EXIT_CODE_USAGE;
	}
	let_go();
	become_realtime();
	if (send(GUARD_STATION, "g", 1, 0) == 1)
		keep_guard(page, (uint32_t)count, (uint32_t)levels);
	return EXIT_CODE_OK;
}
